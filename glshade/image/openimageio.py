"""OpenImageIO: writes and reads picture files with the library of that name, for most formats."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from glshade.files import check_regular
from glshade.image.contents import Part, PictureContents

# Linux's folder with a path for each open file of this process, through which libraries can write to a file in memory.
OPEN_FILES = "/proc/self/fd"
# OpenEXR's names of the camera's matrices -> OpenImageIO's.
MATRICES = {"worldToCamera": "worldtocamera", "worldToNDC": "worldtoNDC"}
# An encoded picture is copied from memory to its file in pieces of this size [bytes].
COPIED = 1 << 20


def write(
    path: Path, contents: PictureContents, settings: Mapping[str, str | int], window: bool, matrices: bool = False
) -> None:
    """Writes a picture file in the format that the suffix of `path` names.

    On Linux with /proc the file is encoded in memory: if the disk were full, the JPEG library would end the process.
    settings: OpenImageIO's attributes of the file, by name, in the order in which they are set.
    window: True to store the place of a crop and the size of the whole picture.
    matrices: True to store the camera's matrices.
    Errors: OSError, with the reason as its text.
    """
    spec = _spec(contents)
    if window:
        spec.x, spec.y = contents.corner
        spec.full_width, spec.full_height = contents.whole or (spec.width, spec.height)
    for name, value in settings.items():
        spec.attribute(name, value)
    if matrices:
        for name, matrix in contents.matrices.items():
            spec.attribute(MATRICES[name], "matrix", np.asarray(matrix, dtype=np.float32).reshape(-1))
    output = oiio.ImageOutput.create(str(path))
    if output is None:
        raise OSError(_error(oiio))
    if not hasattr(os, "memfd_create") or not Path(OPEN_FILES).is_dir():
        _encode(output, str(path), spec, contents.pixels)
        return
    with open(os.memfd_create("picture"), "rb") as memory, path.open("wb") as file:
        _encode(output, f"{OPEN_FILES}/{memory.fileno()}", spec, contents.pixels)
        shutil.copyfileobj(memory, file, COPIED)


def _encode(output: Any, path: str, spec: oiio.ImageSpec, pixels: NDArray[Any]) -> None:
    """Writes pixels (H, W, C) to a file in the format of `output`. Errors: OSError, with the reason as its text."""
    written = output.open(path, spec) and output.write_image(_contiguous(pixels))
    # close() writes the buffered rest. On a full disk it may return True and leave an error message. A message about
    # Exif is no failure: the TIFF writer leaves it if it could not add a table of Exif data.
    closed = output.close()
    message = _error(output)
    if not (closed and written) or (message and "Exif" not in message):
        raise OSError(message or _error(oiio))


def read(path: Path) -> PictureContents:
    """Returns the pixels of the first part of a picture file, at its largest size: (H, W, C) uint8 for 8-bit codes, or float32.

    Integers count as sRGB-encoded, floats as linear. Errors: OSError, with the reason as its text.
    """
    source = _opened(path, _keep_straight_alpha())
    spec = source.spec()
    # A file whose channels differ in type lists their types.
    codes = str(spec.format) == "uint8" and not spec.channelformats
    pixels = source.read_image(oiio.UINT8 if codes else oiio.FLOAT)
    message = _error(source)
    source.close()
    if pixels is None or message:
        raise OSError(message or "no pixels")
    return PictureContents(
        np.asarray(pixels, dtype=np.uint8 if codes else np.float32).reshape(spec.height, spec.width, spec.nchannels),
        encoding="linear" if str(spec.format) in {"float", "half", "double"} else "srgb",
        premultiplied=not spec.get_int_attribute("oiio:UnassociatedAlpha"),
    )


def parts(path: Path) -> list[Part]:
    """Returns the parts of a picture file from their headers, without reading their pixels.

    Errors: OSError, with the reason as its text, also where a part holds anything but 8-bit codes or floats, is CMYK, a volume
    or deep, or has no pixels.
    """
    source = _opened(path, _keep_straight_alpha())
    found: list[Part] = []
    try:
        while source.seek_subimage(len(found), 0):
            found.append(_part(path, len(found), source.spec()))
        # Some formats leave a message when there is no further part. It must be fetched, or it would go to stderr.
        message = _error(source)
    finally:
        source.close()
    if not found:
        raise OSError(message or "has no parts")
    return found


def _part(path: Path, index: int, spec: oiio.ImageSpec) -> Part:
    """Returns one part of a file from its header. Errors: OSError where `parts` refuses it."""
    kind = str(spec.format)
    # Only a file whose channels differ in type lists their types.
    for stored in {str(channel) for channel in spec.channelformats} | {kind}:
        if stored not in {"uint8", "float", "half"}:
            raise OSError(f"holds numbers of the type {stored}; only 8-bit integers, float and half are compared")
    if any(item.name.endswith(":ColorSpace") and item.value in {"CMYK", "YCCK"} for item in spec.extra_attribs):
        raise OSError("is CMYK; only grey and RGB pictures are compared")
    if spec.deep or spec.depth > 1:
        raise OSError("is deep or a volume; only flat pictures are compared")
    if spec.width < 1 or spec.height < 1 or spec.nchannels < 1:
        raise OSError("has no pixels")
    return Part(
        name=spec.get_string_attribute("oiio:subimagename"),
        channels=tuple(spec.channelnames),
        size=(spec.width, spec.height),
        corner=(spec.x - spec.full_x, spec.y - spec.full_y),
        whole=(spec.full_width, spec.full_height),
        orientation=spec.get_int_attribute("Orientation", 1),
        floats=kind != "uint8",
        read=partial(_read_part, path, index, oiio.UINT8 if kind == "uint8" else oiio.FLOAT),
    )


def _read_part(path: Path, index: int, kind: Any) -> NDArray[Any]:
    """Returns the pixels of a part, (H, W, C), as numbers of OpenImageIO's type `kind`. Errors: OSError."""
    source = _opened(path, _keep_straight_alpha())
    spec = source.spec(index, 0)
    pixels = source.read_image(index, 0, 0, spec.nchannels, kind)
    message = _error(source)
    source.close()
    if pixels is None or message:
        raise OSError(message or "no pixels")
    return np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels)


def _keep_straight_alpha() -> oiio.ImageSpec:
    """Returns the settings of a file that is opened for reading: colours are not multiplied by alpha."""
    settings = oiio.ImageSpec()
    settings.attribute("oiio:UnassociatedAlpha", 1)
    return settings


def pixel_count(path: Path) -> int:
    """Returns the number of pixels of a picture from its file's header. More than four channels count as further pixels.

    Errors: OSError, with the reason as its text.
    """
    source = _opened(path)
    spec = source.spec()
    source.close()
    return int(spec.width * spec.height * spec.depth * max(1, math.ceil(spec.nchannels / 4)))


def attributes(path: Path) -> dict[str, str]:
    """Returns the texts in a file's header, by name, without reading its pixels.

    Errors: OSError, with the reason as its text.
    """
    source = _opened(path)
    texts = {item.name: item.value for item in source.spec().extra_attribs if isinstance(item.value, str)}
    source.close()
    return texts


def _opened(path: Path, *config: oiio.ImageSpec) -> Any:
    """Returns the file, opened for reading. Errors: OSError."""
    check_regular(path)
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise OSError("its name is not UTF-8, which OpenImageIO requires; rename it") from None
    source = oiio.ImageInput.open(str(path), *config)
    if source is None:
        # Some readers fail without a message.
        raise OSError(_error(oiio) or "is damaged")
    return source


def _spec(contents: PictureContents) -> oiio.ImageSpec:
    """Returns OpenImageIO's description of the pixels: their size, type, channels, colour space and kind of alpha."""
    height, width, count = contents.pixels.shape
    stored = {"float32": "float", "uint16": "uint16"}.get(str(contents.pixels.dtype), "uint8")
    spec = oiio.ImageSpec(width, height, count, stored)
    if contents.channels is not None:
        spec.channelnames = tuple(contents.channels)
    # Programs take an 8-bit file for sRGB by default, and naming sRGB would make OpenImageIO load a colour configuration, which
    # takes 20 ms.
    if contents.encoding != "srgb":
        spec.attribute("oiio:ColorSpace", "lin_rec709" if contents.encoding == "linear" else contents.encoding)
    if count == 4 and not contents.premultiplied:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    return spec


def _contiguous(pixels: NDArray[Any]) -> NDArray[Any]:
    """Returns the same pixels (H, W, C), contiguous in memory as OpenImageIO needs them."""
    if pixels.flags.c_contiguous:
        return pixels
    result = np.empty(pixels.shape, dtype=pixels.dtype)
    # One channel at a time: NumPy takes five times as long to copy three of four channels at once.
    for channel in range(pixels.shape[2]):
        result[..., channel] = pixels[..., channel]
    return result


def _error(source: Any) -> str:
    """Returns the error message that a file, or OpenImageIO itself, has left, in one line; empty if there is none."""
    try:
        message: str = source.geterror()
    except UnicodeDecodeError as error:
        # The message quotes a damaged name from the file.
        message = error.object.decode(errors="backslashreplace")
    return "; ".join(line.strip() for line in message.splitlines() if line.strip())
