"""Picture files: reads and writes pictures in the format that a file's suffix names. A file is written whole or not at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from glshade.errors import AssetError, GlshadeError
from glshade.files import read_bytes, replacing
from glshade.image.chunks import check_chunks
from glshade.image.contents import Part, PictureContents
from glshade.image.formats import FORMATS, PictureFormat
from glshade.limits import LARGEST_MESH

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# The encoding of a picture's colours; "auto" takes integers as sRGB-encoded and floats as linear.
Encoding = Literal["auto", "srgb", "linear"]
# The suffixes of the files that can be written.
SUFFIXES = frozenset(f".{name}" for name in FORMATS)


def check_suffix(path: str | Path) -> None:
    """Checks that a picture can be written to a file with the suffix of `path`. Errors: GlshadeError."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        suffix = path.suffix or "a file without extension"
        raise GlshadeError(f"{path}: cannot write {suffix}; allowed: {', '.join(sorted(SUFFIXES))}")


def format_of(path: str | Path) -> PictureFormat:
    """Returns the format in which a picture is written to `path`. Errors: GlshadeError where no format has the suffix."""
    check_suffix(path)
    return _format_to_read(path)


def write(path: Path, contents: PictureContents) -> None:
    """Writes a picture file; a file that is there already stays as it is until the new one is complete.

    Alpha and the window of a crop are left out where the format does not hold them. Errors: GlshadeError.
    """
    picture_format = format_of(path)
    if not path.parent.is_dir():
        raise GlshadeError(f"{path}: the folder {path.parent} does not exist; make it first")
    if not picture_format.alpha:
        contents = replace(contents, pixels=contents.pixels[..., :3])
    try:
        with replacing(path) as temporary:
            picture_format.write(temporary, contents)
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror or error}") from None


def read(path: str | Path, encoding: Encoding = "auto") -> tuple[NDArray[np.float32], bool]:
    """Returns a picture for use as a texture, and whether its file has alpha.

    The picture is (H, W, 4) float32, linear Rec. 709 with straight alpha; alpha is 1 where the file has none. More formats can
    be read than written.
    encoding: the encoding of the file's colours; "auto" takes integers as sRGB-encoded and floats as linear.
    Errors: AssetError.
    """
    return for_texture(read_contents(path), encoding)


def read_contents(path: str | Path) -> PictureContents:
    """Returns the pixels of a picture file: 8-bit codes as they are stored, everything else as float32. Errors: AssetError."""
    try:
        return _format_to_read(path).read(Path(path))
    except OSError as error:
        raise _unreadable(path, error) from None


def for_texture(contents: PictureContents, encoding: Encoding) -> tuple[NDArray[np.float32], bool]:
    """Returns a picture that was read, as `read` returns it, and whether it has alpha. encoding: as for `read`."""
    import numpy as np

    from glshade.image.srgb import srgb_to_linear

    pixels, has_alpha = contents.pixels, contents.has_alpha
    if pixels.dtype == np.uint8:
        # OpenImageIO multiplies by the rounded reciprocal, too.
        pixels = pixels * np.float32(1 / 255)
    count = pixels.shape[2]
    colour = pixels[..., : count - has_alpha]
    if encoding == "srgb" or (encoding == "auto" and contents.encoding == "srgb"):
        colour = srgb_to_linear(colour)
    if colour.shape[2] < 3:
        colour = np.repeat(colour[..., :1], 3, axis=2)
    alpha = pixels[..., -1:] if has_alpha else np.ones_like(colour[..., :1])
    if has_alpha and contents.premultiplied:
        colour = np.divide(colour, alpha, out=colour.copy(), where=alpha > 0)
    return np.concatenate([colour[..., :3], alpha], axis=2), has_alpha


def parts(path: str | Path) -> list[Part]:
    """Returns the parts of a picture file, from their headers. Errors: AssetError, also for a part that `read_part` refuses."""
    try:
        return _format_to_read(path).parts(Path(path))
    except OSError as error:
        raise _unreadable(path, error) from None


def read_part(path: str | Path, part: Part) -> NDArray[np.uint8] | NDArray[np.float32]:
    """Returns the pixels of one of the file's parts as they are stored, (H, W, C). Errors: AssetError."""
    try:
        return part.read()
    except OSError as error:
        raise _unreadable(path, error) from None


def attributes(path: str | Path) -> dict[str, str]:
    """Returns the texts about the picture in a file, by name; none if the file is missing or cannot be read as a picture."""
    if not Path(path).is_file():
        return {}
    try:
        return _format_to_read(path).attributes(Path(path))
    except OSError:
        return {}


def probe(path: str | Path) -> None:
    """Reads a file's header alone. Errors: AssetError where the file cannot be read as a picture."""
    try:
        _format_to_read(path).attributes(Path(path))
    except OSError as error:
        raise _unreadable(path, error) from None


def check_stored(path: str | Path) -> None:
    """Checks a picture file for damage that can be found without decoding it. Errors: AssetError."""
    try:
        check_chunks(read_bytes(path, LARGEST_MESH))
    except OSError as error:
        raise _unreadable(path, error) from None


def check(path: str | Path) -> None:
    """Decodes a picture, and keeps nothing of it. Errors: AssetError where the file cannot be read as a picture."""
    try:
        _format_to_read(path).read(Path(path))
    except OSError as error:
        raise _unreadable(path, error) from None


def pixel_count(path: str | Path) -> int:
    """Returns the number of pixels of a picture, from its file's header, with up to four channels each. Errors: AssetError."""
    try:
        return _format_to_read(path).pixel_count(Path(path))
    except OSError as error:
        raise _unreadable(path, error) from None


def _format_to_read(path: str | Path) -> PictureFormat:
    """Returns the format of the path's suffix, by default PictureFormat, which leaves everything to OpenImageIO."""
    name = Path(path).suffix.lower()[1:]
    return FORMATS[name]() if name in FORMATS else PictureFormat()


def _unreadable(path: str | Path, error: OSError) -> AssetError:
    """Returns the error to raise for a file that cannot be read, with the reason."""
    return AssetError(f"{path}: cannot be read as a picture: {error.strerror or error}")
