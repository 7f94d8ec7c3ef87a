"""Image: an array with channels and a colour space; files through OpenImageIO."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.errors import AssetError, GlshadeError

Encoding = Literal["linear", "srgb"]
FLOAT_SUFFIXES = frozenset({".exr", ".hdr"})
BYTE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff"})
SUFFIXES = FLOAT_SUFFIXES | BYTE_SUFFIXES
# Of 9: level 6 takes three times as long for files two thirds the size.
PNG_LEVEL = 1
JPEG_QUALITY = 95


def linear_to_srgb(c: NDArray[Any]) -> NDArray[np.float32]:
    """Linear [0, 1] to sRGB-encoded [0, 1], any shape; what is outside is clipped. IEC 61966-2-1."""
    c = np.clip(np.asarray(c, dtype=np.float32), 0.0, 1.0)
    return np.where(c > 0.0031308, 1.055 * np.maximum(c, 0.0031308) ** (1 / 2.4) - 0.055, 12.92 * c).astype(np.float32)


def srgb_to_linear(c: NDArray[Any]) -> NDArray[np.float32]:
    """sRGB-encoded [0, 1] to linear, any shape. IEC 61966-2-1."""
    c = np.asarray(c, dtype=np.float32)
    return np.where(c > 0.04045, ((np.maximum(c, 0.04045) + 0.055) / 1.055) ** 2.4, c / 12.92).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Image:
    """A picture, row 0 at the top.

    pixels (H, W, 3 or 4): float32 and linear Rec. 709 with premultiplied alpha, or uint8, sRGB-encoded or linear as
    `encoding` says, with straight alpha. attributes: what EXR files carry beside the pixels.
    """

    pixels: NDArray[Any]
    encoding: Encoding = "linear"
    attributes: dict[str, str] = field(default_factory=dict)

    @property
    def channels(self) -> str:
        """RGB or RGBA."""
        return "RGBA"[: self.pixels.shape[2]]

    @property
    def colour_space(self) -> str:
        """linear Rec. 709, or sRGB-encoded."""
        return "linear Rec. 709" if self.encoding == "linear" else "sRGB-encoded"

    @property
    def shape(self) -> tuple[int, ...]:
        """(height, width, channels)."""
        return self.pixels.shape

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.pixels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        height, width, _ = self.shape
        return f"<Image {width}x{height} {self.channels} {self.pixels.dtype}, {self.colour_space}>"

    def linear(self) -> Image:
        """float32, linear Rec. 709, premultiplied."""
        if self.pixels.dtype == np.float32:
            return self
        c = self.pixels.astype(np.float32) / 255
        rgb: NDArray[Any] = srgb_to_linear(c[..., :3]) if self.encoding == "srgb" else c[..., :3]
        c = np.concatenate([rgb * c[..., 3:], c[..., 3:]], axis=2) if c.shape[2] == 4 else rgb
        return Image(c, "linear", self.attributes)

    def encoded(self, encoding: Encoding = "srgb") -> Image:
        """uint8, to the nearest code; straight alpha. An image that has 8 bits already stays as it is."""
        if self.pixels.dtype == np.uint8:
            return self
        rgb: NDArray[Any] = self.pixels[..., :3]
        if self.channels == "RGBA":
            alpha = self.pixels[..., 3:]
            rgb = np.divide(rgb, alpha, out=np.zeros_like(rgb), where=alpha > 0)
        c: NDArray[Any] = linear_to_srgb(rgb) if encoding == "srgb" else np.clip(rgb, 0, 1)
        if self.channels == "RGBA":
            c = np.concatenate([c, np.clip(alpha, 0, 1)], axis=2)
        return Image((c * 255 + 0.5).astype(np.uint8), encoding, self.attributes)

    def save(self, path: str | Path) -> None:
        """Writes the picture; the extension says how.

        EXR, HDR: float32, linear. PNG, JPEG, TIFF: 8-bit, sRGB-encoded unless the image is 8-bit linear. JPEG has no alpha.
        The file appears whole or not at all. Errors: GlshadeError.
        """
        path = Path(path)
        check_suffix(path)
        if path.suffix.lower() in FLOAT_SUFFIXES:
            if self.pixels.dtype != np.float32:
                warnings.warn(
                    f"{path}: an 8-bit image is saved as float; render with dtype='float32' for all its digits",
                    stacklevel=2,
                )
            image = self.linear()
        else:
            image = self.encoded()
        _write(path, image)

    def _repr_png_(self) -> bytes:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "image.png"
            self.save(path)
            return path.read_bytes()


def check_suffix(path: Path) -> None:
    """Errors: GlshadeError where the extension names no format that is written here."""
    if path.suffix.lower() not in SUFFIXES:
        raise GlshadeError(
            f"{path}: cannot write {path.suffix or 'a file without extension'}; allowed: {', '.join(sorted(SUFFIXES))}"
        )


def _write(path: Path, image: Image) -> None:
    import OpenImageIO as oiio

    pixels = image.pixels
    if path.suffix.lower() in {".jpg", ".jpeg", ".hdr"}:
        pixels = pixels[..., :3]
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, "float" if pixels.dtype == np.float32 else "uint8")
    # sRGB is what everybody takes an 8-bit file for, and saying so would load a colour configuration for 20 ms.
    if image.encoding == "linear":
        spec.attribute("oiio:ColorSpace", "lin_rec709")
    if pixels.dtype == np.uint8 and channels == 4:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("png:compressionLevel", PNG_LEVEL)
    spec.attribute("Compression", f"jpeg:{JPEG_QUALITY}" if path.suffix.lower() in {".jpg", ".jpeg"} else "zip")
    # No time of day inside: the same picture is the same bytes.
    spec.attribute("Software", "glshade")
    for name, value in image.attributes.items():
        spec.attribute(name, value)
    if not path.parent.is_dir():
        raise GlshadeError(f"{path}: the folder {path.parent} does not exist; make it first")
    beside = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        output = oiio.ImageOutput.create(str(beside))
        if output is None:
            raise GlshadeError(f"{path}: cannot be written: {_one_line(oiio.geterror())}")
        written = output.open(str(beside), spec) and output.write_image(np.ascontiguousarray(pixels))
        # A full disk may show in the message alone: what was buffered is written when the file is closed. (TIFF's message
        # may be of an Exif table that it could not make, which is no loss.)
        closed = output.close()
        message = _one_line(output.geterror())
        if not (closed and written) or (message and "Exif" not in message):
            raise GlshadeError(f"{path}: cannot be written: {message or _one_line(oiio.geterror())}")
        os.replace(beside, path)
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        beside.unlink(missing_ok=True)


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
    import OpenImageIO as oiio

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
