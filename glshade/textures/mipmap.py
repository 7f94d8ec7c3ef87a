"""Mipmaps: the smaller copies of a picture that are uploaded with it, for both renderers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]


def levels(pixels: Pixels) -> Iterator[Pixels]:
    """Yields the mipmap levels (H, W, C), from the picture itself down to one pixel.

    Each level is half as wide and high as the level before it, and averages that level's pixels by area. A side of odd length
    is weighted as in Guthe and Heckbert 2005, so that no row of pixels is lost.
    """
    yield pixels
    while max(pixels.shape[:2]) > 1:
        pixels = _halved(_halved(pixels, 0), 1)
        yield pixels


def _halved(pixels: Pixels, axis: int) -> Pixels:
    """Returns the picture at half its length along one axis; a length of 1 stays."""
    x = np.moveaxis(pixels, axis, 0)
    size = len(x)
    if size == 1:
        return pixels
    half = size // 2
    if size % 2 == 0:
        result = 0.5 * (x[0::2] + x[1::2])
    else:
        # Guthe and Heckbert 2005: every result averages three neighbours, whose weights change along the axis.
        i = np.arange(half, dtype=np.float32)[:, None, None]
        first, middle, last = x[0:-2:2], x[1:-1:2], x[2::2]
        result = ((half - i) * first + half * middle + (i + 1) * last) / size
    return np.ascontiguousarray(np.moveaxis(result.astype(np.float32), 0, axis))
