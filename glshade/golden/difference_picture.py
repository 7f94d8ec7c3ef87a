"""Difference pictures: a grey picture that shows where two pictures differ, and by how much."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from glshade.golden.judge import pairs
from glshade.image import file as picture_file
from glshade.image.contents import PictureContents


def write_difference(reference: Path, test: Path, path: Path) -> None:
    """Writes the differences of the first layer that differs, of two files whose headers agree.

    Each pixel is the largest absolute difference of its channels; an infinite or NaN value gives white. A format with 8 bits
    shows the largest difference as white, and a format with floats holds the differences as they are. Nothing is written where
    all layers are equal. Errors: AssetError, GlshadeError.
    """
    for pair in pairs(reference, test):
        if not pair.count:
            continue
        grey = np.zeros(pair.changed.shape, dtype=np.float32)
        grey[pair.changed] = np.nan_to_num(pair.errors, nan=1.0, posinf=1.0)
        floats = picture_file.format_of(path).floats
        if not floats:
            grey = np.rint(grey * (255 / grey.max(initial=1e-30))).astype(np.uint8)
        picture = np.repeat(grey[..., None], 3, axis=2)
        picture_file.write(path, PictureContents(picture, "linear" if floats else "srgb", premultiplied=False))
        return
