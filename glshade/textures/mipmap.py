"""Mipmaps: the smaller copies of a picture that are uploaded with it, for both renderers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]

# A picture is converted this many rows at a time, so that the converted rows stay in the processor's cache.
BAND = 32


def levels(pixels: Pixels) -> Iterator[Pixels]:
    """Yields the mipmap levels (H, W, C), from the picture itself down to one pixel.

    Each level is half as wide and high as the level before it, and averages that level's pixels by area. A side of odd length
    is weighted as in Guthe and Heckbert 2005, so that no row of pixels is lost.
    """
    yield pixels
    while max(pixels.shape[:2]) > 1:
        pixels = _halved(_halved(pixels, 0), 1)
        yield pixels


def smaller_levels(stored: NDArray[Any], decode: Callable[[NDArray[Any]], Pixels]) -> Iterator[Pixels]:
    """Yields the mipmap levels (H, W, C) of a picture without the picture itself, which is never decoded as a whole.

    stored: the picture (H, W, C) in a form that takes less memory than float32.
    decode: returns rows of such a picture as the numbers that are averaged.
    """
    height = len(stored)
    if max(stored.shape[:2]) == 1:
        return
    # Where the height is odd, a pixel averages three rows, so that bands of rows would need each other.
    yield from levels(in_bands(lambda rows: _halved(_halved(decode(rows), 0), 1), stored, BAND if height % 2 == 0 else height))


def in_bands(convert: Callable[[NDArray[Any]], NDArray[Any]], rows: NDArray[Any], band: int = BAND) -> NDArray[Any]:
    """Returns the result of a conversion of rows, which is done for `band` rows at a time."""
    if len(rows) <= band:
        return convert(rows)
    return np.concatenate([convert(rows[first : first + band]) for first in range(0, len(rows), band)])


def _halved(pixels: Pixels, axis: int) -> Pixels:
    """Returns the picture at half its length along one axis; a length of 1 stays."""
    size = pixels.shape[axis]
    if size == 1:
        return pixels
    if size % 2 == 0:
        result = pixels[0::2] + pixels[1::2] if axis == 0 else _paired(pixels)
        result *= np.float32(0.5)
        return result
    # Guthe and Heckbert 2005: every result averages three neighbours, whose weights change along the axis.
    x, half = np.moveaxis(pixels, axis, 0), size // 2
    i = np.arange(half, dtype=np.float32)[:, None, None]
    first, middle, last = x[0:-2:2], x[1:-1:2], x[2::2]
    weighted = ((half - i) * first + half * middle + (i + 1) * last) / size
    return np.ascontiguousarray(np.moveaxis(weighted.astype(np.float32, copy=False), 0, axis))


def _paired(pixels: Pixels) -> Pixels:
    """Returns the sums (H, W / 2, C) of each pixel in an even column and its right neighbour."""
    height, width, channels = pixels.shape
    result = np.empty((height, width // 2, channels), dtype=np.float32)
    # One channel at a time: NumPy takes five times as long to add three or four channels at once.
    for channel in range(channels):
        np.add(pixels[:, 0::2, channel], pixels[:, 1::2, channel], out=result[..., channel])
    return result
