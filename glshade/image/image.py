"""Image: an array with channels and a colour space."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.image.file import FLOAT_SUFFIXES, check_suffix, write
from glshade.image.srgb import linear_to_srgb, srgb_to_linear

Encoding = Literal["linear", "srgb"]


@dataclass(frozen=True, eq=False)
class Image:
    """A picture, row 0 at the top.

    pixels (H, W, 3 or 4): float32 and linear Rec. 709 with premultiplied alpha, or uint8 with straight alpha, encoded as
    `encoding` says: linear, srgb, or what a view transform left, by its colour interop id ("unknown" without one).
    attributes: what files say of themselves beside the pixels; HDR says nothing. corner, whole: of a crop, where it lies and
    the size of the picture that it is of [pixels]; OpenEXR keeps both.
    """

    pixels: NDArray[Any]
    encoding: str = "linear"
    attributes: dict[str, str] = field(default_factory=dict)
    corner: tuple[int, int] = (0, 0)
    whole: tuple[int, int] | None = None

    @property
    def channels(self) -> str:
        """RGB or RGBA."""
        return "RGBA"[: self.pixels.shape[2]]

    @property
    def colour_space(self) -> str:
        """linear Rec. 709, sRGB-encoded, or display-encoded with its name."""
        named = {"linear": "linear Rec. 709", "srgb": "sRGB-encoded"}
        return named.get(self.encoding) or f"display-encoded ({self.encoding})"

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
        """float32, linear Rec. 709, premultiplied. Errors: GlshadeError after a view transform for another display."""
        if self.pixels.dtype == np.float32:
            return self
        if self.encoding not in ("linear", "srgb"):
            raise GlshadeError(f"{self!r} does not become linear again: render with dtype='float32'")
        c = self.pixels.astype(np.float32) / 255
        rgb: NDArray[Any] = srgb_to_linear(c[..., :3]) if self.encoding == "srgb" else c[..., :3]
        c = np.concatenate([rgb * c[..., 3:], c[..., 3:]], axis=2) if c.shape[2] == 4 else rgb
        return replace(self, pixels=c, encoding="linear")

    def encoded(self, encoding: Encoding = "srgb") -> Image:
        """uint8, to the nearest code; straight alpha. An image that has 8 bits already stays as it is."""
        if self.pixels.dtype == np.uint8:
            return self
        return self.through(linear_to_srgb if encoding == "srgb" else lambda rgb: rgb, encoding)

    def through(self, transform: Callable[[NDArray[np.float32]], NDArray[Any]], encoding: str) -> Image:
        """uint8, to the nearest code, of a float image; straight alpha.

        transform: of colours (H, W, 3), before alpha multiplies them, to their numbers in `encoding`, clipped to 0 to 1.
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
        """Writes the picture; the extension says how.

        EXR, HDR: float32, linear. PNG, JPEG, TIFF: 8-bit, sRGB-encoded unless the image has 8 bits of another kind. JPEG has no
        alpha. attributes: what the file says of itself, too.
        The file appears whole or not at all. Errors: GlshadeError.
        """
        path = Path(path)
        check_suffix(path)
        if path.suffix.lower() in FLOAT_SUFFIXES:
            image = self.linear()
            if self.pixels.dtype != np.float32:
                warnings.warn(
                    f"{path}: an 8-bit image is saved as float; render with dtype='float32' for all its digits",
                    stacklevel=2,
                )
        else:
            image = self.encoded()
        write(
            path,
            image.pixels,
            encoding=image.encoding,
            attributes={**image.attributes, **(attributes or {})},
            corner=image.corner,
            whole=image.whole,
        )

    def _repr_png_(self) -> bytes:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "image.png"
            self.save(path)
            return path.read_bytes()
