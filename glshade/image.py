"""Image: an array with channels and a colour space."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.picture_file import FLOAT_SUFFIXES, check_suffix, write
from glshade.srgb import linear_to_srgb, srgb_to_linear

Encoding = Literal["linear", "srgb"]


@dataclass(frozen=True, eq=False)
class Image:
    """A picture, row 0 at the top.

    pixels (H, W, 3 or 4): float32 and linear Rec. 709 with premultiplied alpha, or uint8, sRGB-encoded or linear as
    `encoding` says, with straight alpha. attributes: what files say of themselves beside the pixels; HDR says nothing.
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
        write(path, image.pixels, linear=image.encoding == "linear", attributes=image.attributes)

    def _repr_png_(self) -> bytes:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "image.png"
            self.save(path)
            return path.read_bytes()
