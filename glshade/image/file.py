"""Picture files: PNG, JPEG, TIFF, OpenEXR and HDR, through OpenImageIO. They appear whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from glshade.errors import AssetError, GlshadeError
from glshade.files import replacing

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FLOAT_SUFFIXES = frozenset({".exr", ".hdr"})
BYTE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff"})
SUFFIXES = FLOAT_SUFFIXES | BYTE_SUFFIXES
# What has no room for attributes of one's own: there they are one JSON object, in the description.
DESCRIBED = frozenset({".jpg", ".jpeg", ".tif", ".tiff"})
# Of 9: level 6 takes three times as long for files two thirds the size.
PNG_LEVEL = 1
# libpng's number for one filter, the difference to the pixel above: trying all five, which it does when not told, takes
# twice as long and gains nothing on rendered pictures.
PNG_FILTER_UP = 32
JPEG_QUALITY = 95
# OpenImageIO writes the time of day where it is told none; the same picture is the same bytes.
NO_TIME = "1970:01:01 00:00:00"


def check_suffix(path: Path) -> None:
    """Errors: GlshadeError where the extension names no format that is written here."""
    if path.suffix.lower() not in SUFFIXES:
        raise GlshadeError(
            f"{path}: cannot write {path.suffix or 'a file without extension'}; allowed: {', '.join(sorted(SUFFIXES))}"
        )


def write(
    path: Path,
    pixels: NDArray[Any],
    *,
    channels: Sequence[str] | None = None,
    encoding: str = "srgb",
    attributes: Mapping[str, str] | None = None,
    corner: tuple[int, int] = (0, 0),
    whole: tuple[int, int] | None = None,
) -> None:
    """pixels (H, W, C), uint8 or float32, row 0 at the top; the extension says how.

    channels: their names; left out: R, G, B, A. encoding: of 8-bit numbers: srgb, linear, or the colour interop id of another
    colour space; PNG has a chunk for what video knows. attributes: what the file says of itself; HDR has no room for them.
    corner, whole: of a crop, where it lies and the size of the picture that it is of [pixels]; OpenEXR keeps both.
    Errors: GlshadeError.
    """
    import OpenImageIO as oiio

    suffix = path.suffix.lower()
    check_suffix(path)
    if suffix in {".jpg", ".jpeg", ".hdr"}:
        pixels = pixels[..., :3]
    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, "float" if pixels.dtype == "float32" else "uint8")
    if channels is not None:
        spec.channelnames = tuple(channels)
    if suffix == ".exr":
        spec.x, spec.y = corner
        spec.full_width, spec.full_height = whole or (width, height)
    # sRGB is what everybody takes an 8-bit file for, and saying so would load a colour configuration for 20 ms.
    if pixels.dtype == "float32" or encoding == "linear":
        spec.attribute("oiio:ColorSpace", "lin_rec709")
    elif encoding != "srgb":
        spec.attribute("oiio:ColorSpace", encoding)
    if pixels.dtype == "uint8" and count == 4:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("png:compressionLevel", PNG_LEVEL)
    spec.attribute("png:filter", PNG_FILTER_UP)
    spec.attribute("Compression", f"jpeg:{JPEG_QUALITY}" if suffix in {".jpg", ".jpeg"} else "zip")
    spec.attribute("Software", "glshade")
    if suffix in {".exr", ".tif", ".tiff"}:
        spec.attribute("DateTime", NO_TIME)
    if attributes and suffix in DESCRIBED:
        spec.attribute("ImageDescription", json.dumps(dict(attributes), separators=(",", ":")))
    else:
        for name, value in (attributes or {}).items():
            spec.attribute(name, value)
    if not path.parent.is_dir():
        raise GlshadeError(f"{path}: the folder {path.parent} does not exist; make it first")
    try:
        with replacing(path) as beside:
            output = oiio.ImageOutput.create(str(beside))
            if output is None:
                raise GlshadeError(f"{path}: cannot be written: {_one_line(oiio.geterror())}")
            written = output.open(str(beside), spec) and output.write_image(_compact(pixels))
            # A full disk may show in the message alone: what was buffered is written when the file is closed. (TIFF's
            # message may be of an Exif table that it could not make, which is no loss.)
            closed = output.close()
            message = _one_line(output.geterror())
            if not (closed and written) or (message and "Exif" not in message):
                raise GlshadeError(f"{path}: cannot be written: {message or _one_line(oiio.geterror())}")
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror}") from None


def _compact(pixels: NDArray[Any]) -> NDArray[Any]:
    """pixels (H, W, C) without gaps, as OpenImageIO takes them."""
    if pixels.flags.c_contiguous:
        return pixels
    import numpy as np

    result = np.empty(pixels.shape, dtype=pixels.dtype)
    # Channel by channel: NumPy copies three numbers and skips the fourth in five times the time.
    for channel in range(pixels.shape[2]):
        result[..., channel] = pixels[..., channel]
    return result


def attributes(path: str | Path) -> dict[str, str]:
    """What a file says of itself in words: name -> text; {} for what is not there or cannot be read as a picture."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path)) if Path(path).is_file() else None
    if source is None:
        oiio.geterror()
        return {}
    found = {item.name: item.value for item in source.spec().extra_attribs if isinstance(item.value, str)}
    source.close()
    if Path(path).suffix.lower() in DESCRIBED:
        try:
            described = json.loads(found.get("ImageDescription", ""))
        except ValueError:
            described = None
        return described if isinstance(described, dict) else {}
    return found


def _one_line(message: str) -> str:
    return "; ".join(line.strip() for line in message.splitlines() if line.strip())


def probe(path: str | Path) -> None:
    """Whether a file can be read as a picture, by its header. Errors: AssetError."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise AssetError(f"{path}: cannot be read as a picture: {oiio.geterror().strip()}")
    source.close()


def read(path: str | Path, encoding: Literal["auto", "srgb", "linear"] = "auto") -> tuple[NDArray[np.float32], bool]:
    """((H, W, C) float32, linear Rec. 709 with straight alpha; whether it has alpha).

    auto: 8-bit and 16-bit integers are taken as sRGB-encoded, floats as linear. Errors: AssetError.
    """
    import numpy as np
    import OpenImageIO as oiio

    from glshade.image.srgb import srgb_to_linear

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), config)
    if source is None:
        raise AssetError(f"{path}: cannot be read as a picture: {_one_line(oiio.geterror())}")
    spec = source.spec()
    pixels = source.read_image(oiio.FLOAT)
    message = _one_line(source.geterror())
    source.close()
    if pixels is None or message:
        raise AssetError(f"{path}: cannot be read as a picture: {message or 'no pixels'}")
    pixels = np.asarray(pixels, dtype=np.float32).reshape(spec.height, spec.width, spec.nchannels)
    has_alpha = spec.nchannels in (2, 4)
    colour = pixels[..., : spec.nchannels - has_alpha]
    floats = str(spec.format) in {"float", "half", "double"}
    if encoding == "srgb" or (encoding == "auto" and not floats):
        colour = srgb_to_linear(colour)
    if colour.shape[2] < 3:
        colour = np.repeat(colour[..., :1], 3, axis=2)
    alpha = pixels[..., -1:] if has_alpha else np.ones_like(colour[..., :1])
    if has_alpha and not spec.get_int_attribute("oiio:UnassociatedAlpha"):
        # OpenEXR's colours are premultiplied.
        colour = np.divide(colour, alpha, out=colour.copy(), where=alpha > 0)
    return np.concatenate([colour[..., :3], alpha], axis=2), has_alpha
