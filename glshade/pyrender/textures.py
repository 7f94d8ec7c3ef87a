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
        pixels = rgba(source)
        if white:
            pixels[..., :3] = 255
        known = cached[white] = source, PixelArray.of(pixels)
    return known[1]


def rgba(source: Any) -> Bytes:
    """Returns pixels (H, W, 4) from (H, W) or (H, W, C). As in OpenGL, missing colours are 0 and a missing alpha is 1."""
    pixels = np.asarray(source, dtype=np.uint8)
    pixels = pixels.reshape(*pixels.shape[:2], -1)
    result = np.zeros((*pixels.shape[:2], 4), dtype=np.uint8)
    result[..., 3] = 255
    result[..., : pixels.shape[2]] = pixels
    return result
