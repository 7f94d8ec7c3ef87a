"""Textures: converts pyrender's textures, which are arrays, into glshade's pixel arrays."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.textures.pixel_array import PixelArray

Bytes = NDArray[np.uint8]
# texture -> `white`, as `picture` takes it -> (the array that was converted, the picture)
_known: WeakKeyDictionary[Any, dict[bool, tuple[Bytes, PixelArray]]] = WeakKeyDictionary()


def picture(texture: Any, white: bool = False) -> PixelArray | None:
    """Returns the texture's pixels; None for a texture without pixels. It is the same object until `source` is a new array.

    texture: a pyrender.Texture.
    white: True to make all colours white and keep only the alpha.
    """
    source = texture.source
    if source is None:
        return None
    cached = _known.setdefault(texture, {})
    known = cached.get(white)
    if known is None or known[0] is not source:
        pixels = colours(source)
        if white:
            alpha = pixels[..., 3:] if pixels.shape[2] == 4 else 255
            pixels = np.full((*pixels.shape[:2], 4), 255, dtype=np.uint8)
            pixels[..., 3:] = alpha
        known = cached[white] = source, PixelArray.of(pixels)
    return known[1]


def colours(source: Any) -> Bytes:
    """Returns pixels (H, W, 3 or 4) from (H, W) or (H, W, C). As in OpenGL, missing colours are 0."""
    pixels = np.asarray(source, dtype=np.uint8)
    pixels = pixels.reshape(*pixels.shape[:2], -1)
    count = min(pixels.shape[2], 4)
    result = np.zeros((*pixels.shape[:2], max(count, 3)), dtype=np.uint8)
    # pyrender's arrays hold one channel after the other, which NumPy takes twice as long to copy at once.
    for channel in range(count):
        result[..., channel] = pixels[..., channel]
    return result


def has_alpha_below_one(source: Any) -> bool:
    """Returns whether any of the pixels, as `colours` takes them, has an alpha below 1."""
    pixels = np.asarray(source)
    return pixels.ndim == 3 and pixels.shape[2] >= 4 and bool((pixels[..., 3].astype(np.uint8) < 255).any())
