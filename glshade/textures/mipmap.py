"""Mip chains: the smaller and smaller copies of a picture that textures are read from. Part of what is uploaded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]


def levels(pixels: Pixels) -> Iterator[Pixels]:
    """The mipmap chain, from the picture itself down to one pixel: each level is the average over areas of the one before.

    Sides that are odd are weighted as Guthe and Heckbert 2005 do, so that no row is lost.
    """
    yield pixels
    while max(pixels.shape[:2]) > 1:
        pixels = _halved(_halved(pixels, 0), 1)
        yield pixels


def _halved(pixels: Pixels, axis: int) -> Pixels:
    x = np.moveaxis(pixels, axis, 0)
    size = len(x)
    if size == 1:
        return pixels
    half = size // 2
    if size % 2 == 0:
        result = 0.5 * (x[0::2] + x[1::2])
    else:
        i = np.arange(half, dtype=np.float32).reshape(-1, *[1] * (x.ndim - 1))
        first, middle, last = x[0:-2:2], x[1:-1:2], x[2::2]
        result = ((half - i) * first + half * middle + (i + 1) * last) / size
    return np.ascontiguousarray(np.moveaxis(result.astype(np.float32), 0, axis))
