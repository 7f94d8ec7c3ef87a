"""Textures of pyrender, as picture files: glshade's are files, pyrender's are arrays."""

from __future__ import annotations

import hashlib
import tempfile
from functools import cache
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.image.image import Image

Bytes = NDArray[np.uint8]
# What has been written of a texture: the array, and the file.
_written: WeakKeyDictionary[Any, dict[bool, tuple[Bytes, Path]]] = WeakKeyDictionary()


def picture(texture: Any, white: bool = False) -> Path | None:
    """A PNG file with the texture's bytes, which lasts as long as the process; None for a texture without a picture.

    white: its alpha alone, on white.
    """
    source = texture.source
    if source is None:
        return None
    written = _written.setdefault(texture, {})
    known = written.get(white)
    if known is not None and known[0] is source:
        return known[1]
    pixels = rgba(source)
    if white:
        pixels[..., :3] = 255
    # Materials are copied deep in pyrender, and their textures with them: equal pictures are one file.
    path = _folder() / f"{hashlib.sha256(repr(pixels.shape).encode() + pixels.tobytes()).hexdigest()}.png"
    if not path.exists():
        Image(pixels, "srgb").save(path)
    written[white] = source, path
    return path


def rgba(source: Any) -> Bytes:
    """(H, W, 4): as GL fills up a texture with fewer channels: 0 for colours, 1 for alpha."""
    given = np.asarray(source, dtype=np.uint8)
    given = given.reshape(*given.shape[:2], -1)
    result = np.zeros((*given.shape[:2], 4), dtype=np.uint8)
    result[..., 3] = 255
    result[..., : given.shape[2]] = given
    return result


@cache
def _folder() -> Path:
    # Kept by the function's attribute: the folder goes with the object, at the end of the process.
    _folder.kept = tempfile.TemporaryDirectory(prefix="glshade-pyrender-")  # type: ignore[attr-defined]
    return Path(_folder.kept.name)  # type: ignore[attr-defined]
