"""Textures: writes pyrender's textures, which are arrays, to picture files, because glshade reads its textures from files."""

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
# texture -> `white`, as `picture` takes it -> (the array that was written, its file)
_written: WeakKeyDictionary[Any, dict[bool, tuple[Bytes, Path]]] = WeakKeyDictionary()


def picture(texture: Any, white: bool = False) -> Path | None:
    """Returns a PNG file with the texture's bytes; None for a texture without pixels. The file is deleted at process exit.

    texture: a pyrender.Texture.
    white: True to make all colours white and keep only the alpha.
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
    # Files are named after their contents, because pyrender copies materials together with their textures: equal copies then
    # share one file.
    path = _folder() / f"{hashlib.sha256(repr(pixels.shape).encode() + pixels.tobytes()).hexdigest()}.png"
    if not path.exists():
        Image(pixels, "srgb").save(path)
    written[white] = source, path
    return path


def rgba(source: Any) -> Bytes:
    """Returns pixels (H, W, 4) from (H, W) or (H, W, C). As in OpenGL, missing colours are 0 and a missing alpha is 1."""
    pixels = np.asarray(source, dtype=np.uint8)
    pixels = pixels.reshape(*pixels.shape[:2], -1)
    result = np.zeros((*pixels.shape[:2], 4), dtype=np.uint8)
    result[..., 3] = 255
    result[..., : pixels.shape[2]] = pixels
    return result


@cache
def _folder() -> Path:
    """Returns the folder of the files; it is deleted when the process ends."""
    # The folder is deleted together with its TemporaryDirectory object, so an attribute of this function keeps that alive.
    _folder.kept = tempfile.TemporaryDirectory(prefix="glshade-pyrender-")  # type: ignore[attr-defined]
    return Path(_folder.kept.name)  # type: ignore[attr-defined]
