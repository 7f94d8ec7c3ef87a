"""Small: pictures that are reduced for a page, and pictures as the text that a page embeds."""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image.contents import PictureContents
from glshade.image.file import format_of

Array = NDArray[Any]


def smaller(picture: Array, gather: np.ufunc, longest: int) -> Array:
    """Returns a picture reduced by a whole factor, so that neither side is longer than `longest` pixels.

    picture: (H, W, ...), with any number of further axes.
    gather: np.add to average the pixels that become one, np.maximum to take the largest of them.
    """
    step = -(-max(picture.shape[:2]) // longest)
    if step <= 1:
        return picture
    places = [np.arange(0, size, step) for size in picture.shape[:2]]
    result: Array = gather.reduceat(gather.reduceat(picture, places[0], axis=0), places[1], axis=1)
    if gather is np.add:
        rows, columns = (np.diff(np.append(place, size)) for place, size in zip(places, picture.shape, strict=False))
        count = (rows[:, None] * columns).reshape(*result.shape[:2], *[1] * (result.ndim - 2))
        result = (result / count).astype(np.float32)
    return result


def as_base64(pixels: Array, suffix: str) -> str:
    """Returns 8-bit pixels (H, W, C), sRGB-encoded, as a file in base64. suffix: the format, such as png. Errors: OSError."""
    contents = PictureContents(np.ascontiguousarray(pixels), "srgb", premultiplied=False)
    with tempfile.NamedTemporaryFile(suffix=f".{suffix}") as file:
        # The format writes the file itself: image.file.write would wait until it has reached the disk.
        format_of(file.name).write(Path(file.name), contents)
        return base64.b64encode(Path(file.name).read_bytes()).decode("ascii")
