"""Noise of files: the same pixels, stored otherwise by another version of a library or another tool."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import OpenImageIO as oiio

from glshade.bench.corpus.case import Case
from glshade.bench.corpus.kinds import file_noise
from glshade.files import replacing
from glshade.image import openimageio
from glshade.image.contents import PictureContents


def _written(case: Case, path: Path, settings: dict[str, Any], **more: str) -> None:
    """Writes the baseline's pixels with OpenImageIO's settings of the file and with more texts."""
    contents = PictureContents(case.baseline, "linear" if case.floats else "srgb", premultiplied=case.floats)
    with replacing(path) as beside:
        openimageio.write(beside, contents, {**case.attributes, **more, **settings}, window=case.floats)


@file_noise
def not_compressed(case: Case, path: Path) -> None:
    """The file is not compressed."""
    _written(case, path, {"Compression": "none"} if case.floats else {"png:compressionLevel": 0})


@file_noise
def compressed_better(case: Case, path: Path) -> None:
    """The file is compressed by another method, without loss."""
    _written(case, path, {"Compression": "piz"} if case.floats else {"png:compressionLevel": 9})


@file_noise
def filtered_otherwise(case: Case, path: Path) -> None:
    """Another filter of PNG, or another method of EXR, comes before compression."""
    # 128 is libpng's number for the filter "Paeth".
    _written(case, path, {"Compression": "zips"} if case.floats else {"png:filter": 128})


@file_noise
def texts_added(case: Case, path: Path) -> None:
    """The file holds a time and the name of a program, as pictures that went through an editor do."""
    _written(case, path, {}, Software="another program", DateTime="2020:02:20 20:20:20", ImageDescription="a description")


@file_noise
def in_tiles_of_the_file(case: Case, path: Path) -> None:
    """An EXR file is stored in tiles; a PNG file has a resolution in dots per inch."""
    if not case.floats:
        _written(case, path, {"XResolution": 300.0, "YResolution": 300.0, "ResolutionUnit": "in"})
        return
    buffer = oiio.ImageBuf(case.baseline)
    for name, text in case.attributes.items():
        buffer.specmod().attribute(name, text)
    buffer.set_write_tiles(32, 32)
    with replacing(path) as beside:
        buffer.write(str(beside))
