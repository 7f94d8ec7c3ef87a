"""Image: a picture in memory, an array with channels and a colour space."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.calibration.calibration import CAMERA, Calibration
from glshade.errors import GlshadeError
from glshade.image.contents import PictureContents
from glshade.image.file import format_of, write
from glshade.image.srgb import linear_to_srgb, srgb_to_linear

Encoding = Literal["linear", "srgb"]


@dataclass(frozen=True, eq=False)
class Image:
    """A picture.

    pixels: (H, W, 3 or 4), row 0 at the top; float32, linear Rec. 709 with premultiplied alpha, or uint8 with straight alpha.
    encoding: the encoding of uint8 pixels: "linear" or "srgb". After a view transform it is the colour interop id of the
        display's colour space, or "unknown" where that space has no id.
    attributes: texts about the picture, by name, for files of formats that hold any.
    corner: x, y of a crop's top left corner in the whole picture [pixels].
    whole: width, height of the picture that a crop belongs to [pixels]; None where the picture is not cropped.
    calibration: how the picture was seen; None where that is not known.
    """

    pixels: NDArray[Any]
    encoding: str = "linear"
    attributes: dict[str, str] = field(default_factory=dict)
    corner: tuple[int, int] = (0, 0)
    whole: tuple[int, int] | None = None
    calibration: Calibration | None = None

    @property
    def channels(self) -> str:
        """The channels: RGB or RGBA."""
        return "RGBA"[: self.pixels.shape[2]]

    @property
    def colour_space(self) -> str:
        """The colour space in words: "linear Rec. 709", "sRGB-encoded", or "display-encoded" with the encoding's name."""
        named = {"linear": "linear Rec. 709", "srgb": "sRGB-encoded"}
        return named.get(self.encoding) or f"display-encoded ({self.encoding})"

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and number of channels."""
        return self.pixels.shape

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.pixels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        height, width, _ = self.shape
        return f"<Image {width}x{height} {self.channels} {self.pixels.dtype}, {self.colour_space}>"

    def linear(self) -> Image:
        """Returns this picture as float32, linear Rec. 709, premultiplied; a float picture is returned as it is.

        Errors: GlshadeError for 8-bit pixels that a view transform made for a display other than sRGB.
        """
        if self.pixels.dtype == np.float32:
            return self
        if self.encoding not in ("linear", "srgb"):
            raise GlshadeError(f"{self!r} does not become linear again: render with dtype='float32'")
        c = self.pixels.astype(np.float32) / 255
        rgb: NDArray[Any] = srgb_to_linear(c[..., :3]) if self.encoding == "srgb" else c[..., :3]
        c = np.concatenate([rgb * c[..., 3:], c[..., 3:]], axis=2) if self.channels == "RGBA" else rgb
        return replace(self, pixels=c, encoding="linear")

    def encoded(self, encoding: Encoding = "srgb") -> Image:
        """Returns this picture as uint8, rounded to the nearest code, with straight alpha; an 8-bit picture stays as it is."""
        if self.pixels.dtype == np.uint8:
            return self
        return self.through(linear_to_srgb if encoding == "srgb" else lambda rgb: rgb, encoding)

    def through(self, transform: Callable[[NDArray[np.float32]], NDArray[Any]], encoding: str) -> Image:
        """Returns a float picture as uint8, rounded to the nearest code, with straight alpha.

        transform: a function from linear colours (H, W, 3), not multiplied by alpha, to encoded ones, which are then clipped to
            [0, 1].
        encoding: the name of the encoding that `transform` gives.
        """
        rgb: NDArray[Any] = self.pixels[..., :3]
        if self.channels == "RGBA":
            alpha = self.pixels[..., 3:]
            rgb = np.divide(rgb, alpha, out=np.zeros_like(rgb), where=alpha > 0)
        c: NDArray[Any] = transform(rgb)
        if self.channels == "RGBA":
            c = np.concatenate([c, alpha], axis=2)
        return replace(self, pixels=(np.clip(c, 0, 1) * 255 + 0.5).astype(np.uint8), encoding=encoding)

    def save(self, path: str | Path, attributes: Mapping[str, str] | None = None) -> None:
        """Writes the picture in the format that the extension names.

        EXR and HDR hold linear float32 numbers. PNG, JPEG and TIFF hold 8-bit numbers: a float picture is encoded as sRGB, an
        8-bit one is written as it is. JPEG and HDR have no alpha. The file is written whole or not at all.
        attributes: optional texts about the picture, added to the image's own, by name.
        Errors: GlshadeError.
        """
        path = Path(path)
        floats = format_of(path).floats
        contents = self._contents(floats, attributes or {})
        if floats and contents.pixels is not self.pixels:
            warnings.warn(
                f"{path}: an 8-bit image is saved as float; render with dtype='float32' for all its digits",
                stacklevel=2,
            )
        write(path, contents)

    def png(self) -> bytes:
        """Returns the bytes of the PNG file that `save` writes. Errors: OSError."""
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "image.png"
            # The format writes the file itself: `write` would wait until it has reached the disk.
            format_of(path).write(path, self._contents(False, {}))
            return path.read_bytes()

    @property
    def texts_of_camera(self) -> dict[str, str]:
        """The attribute that tells how the picture was seen, as JSON; empty where that is not known."""
        return {} if self.calibration is None else {CAMERA: self.calibration.json()}

    @property
    def matrices(self) -> dict[str, NDArray[np.float64]]:
        """The matrices (4, 4) that OpenEXR defines for the camera, for row vectors; empty where it is not known."""
        if self.calibration is None:
            return {}
        return self.calibration.exr_matrices(self.corner, self.whole or self.calibration.size)

    def _contents(self, floats: bool, attributes: Mapping[str, str]) -> PictureContents:
        """Returns the contents of a picture file. floats: whether it holds float32 numbers. attributes: further texts."""
        image = self.linear() if floats else self.encoded()
        return PictureContents(
            image.pixels,
            encoding="linear" if floats else image.encoding,
            premultiplied=floats,
            attributes={**image.attributes, **image.texts_of_camera, **attributes},
            matrices=image.matrices,
            corner=image.corner,
            whole=image.whole,
        )

    def _repr_png_(self) -> bytes:
        return self.png()
