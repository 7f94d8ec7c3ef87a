"""Film: the size of a picture, its samples, background and encoding, and the layers beside it."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
)

from glshade.document import Document, Finite, Shorthand, fault, nearest, number, resolved, value_of
from glshade.errors import figure
from glshade.image.layer_paths import PNG_AOVS, LayerFormat
from glshade.image.layers import AOVS
from glshade.limits import Limits
from glshade.optics.observer import matching
from glshade.optics.spectra import Spectrum

# The largest side of a picture [pixels]. A row of 2^17 pixels of 16 bytes is 2 MiB, which other programs can still open.
LARGEST_SIDE = 131072
# 16 x 16 pictures already take 256 times as long as one, so a larger number is most likely a typing error.
LARGEST_SUPERSAMPLE = 16

# The largest side of a point [pixels]. The squares of a million points of this size cover 6.5e10 pixels, which takes minutes.
LARGEST_POINT = 256
# The largest number of a background. The sum of 16 x 16 of them fits into float32.
BRIGHTEST = 1e30

# The largest number of bands. With 1 nm for each, more of them change nothing.
MOST_BANDS = 300

Side = Annotated[int, Field(ge=1, le=LARGEST_SIDE), BeforeValidator(number)]
Corner = Annotated[int, Field(ge=0, lt=LARGEST_SIDE), BeforeValidator(number)]


def _colour_with_alpha(value: tuple[float, ...]) -> tuple[float, ...]:
    if len(value) not in (3, 4):
        raise fault(f"must be 3 numbers, or 4 with alpha, not {len(value)}")
    if max(map(abs, value)) > BRIGHTEST:
        raise fault(f"must be at most {BRIGHTEST:g} in absolute value")
    if len(value) == 4 and not 0 <= value[3] <= 1:
        raise fault(f"alpha must be from 0 to 1, not {figure(value[3])}")
    return value


def _configuration(value: Any, info: ValidationInfo) -> Any:
    """Returns the path of a configuration file, or the name of a configuration that is built into OpenColorIO."""
    if not isinstance(value, str | Path) or str(value).startswith("ocio://"):
        return value
    return resolved(Path(value), info)


def _aov(value: str) -> str:
    if value not in AOVS:
        raise fault(f"unknown layer {value!r}" + nearest(value, AOVS))
    return value


def _threes(value: int) -> int:
    if value % 3:
        raise fault(f"must be a multiple of 3, because a shader computes three bands at once, not {value}")
    return value


Aov = Annotated[str, AfterValidator(_aov), WithJsonSchema({"enum": list(AOVS)})]


class Film(Document):
    """The picture itself: its size, samples, background and encoding, and the layers beside it."""

    size: tuple[Side, Side] = Field((512, 512), description="width, height [pixels]")
    crop: tuple[Corner, Corner, Side, Side] | None = Field(
        None,
        description="x, y, width, height from the top left [pixels]: draws only this window, with exactly the same values",
    )
    samples: Literal[1, 2, 4, 8] = Field(
        1, description="samples per pixel, which smooth edges; their mean is taken in linear light"
    )
    supersample: Annotated[int, Field(ge=1, le=LARGEST_SUPERSAMPLE), BeforeValidator(number)] = Field(
        1,
        description="n x n pictures, shifted within the pixel, are averaged in linear light: smooths shading and edges",
    )
    point_size: Annotated[float, Field(ge=1, le=LARGEST_POINT)] = Field(
        1.0, description="side of the squares that points become, and width of lines, in meshes of points and lines [pixels]"
    )
    background: Annotated[tuple[Finite, ...], AfterValidator(_colour_with_alpha)] = Field(
        (0.0, 0.0, 0.0),
        description="colour, linear Rec. 709; a fourth number is its straight alpha, and gives the picture an alpha channel",
    )
    encoding: Literal["srgb", "linear"] = Field("srgb", description="encoding of 8-bit pictures; EXR is always linear")
    exposure: Annotated[float, Field(ge=-64, le=64)] = Field(0.0, description="multiplies all light by 2 to this power [stops]")
    white: Annotated[Spectrum, Shorthand("spectrum")] | None = Field(
        None, description="light that looks white, such as A; left out: D65, and other lights keep their colour"
    )
    bands: Annotated[int, Field(ge=3, le=MOST_BANDS), AfterValidator(_threes), BeforeValidator(number)] = Field(
        12,
        description="bands of wavelengths: for spectra of models that are not linear in their colours, for the layer spectrum",
    )
    view: str | None = Field(
        None, description="OpenColorIO view that transforms 8-bit pictures; left out although display is set: its default view"
    )
    display: str | None = Field(
        None, description="OpenColorIO display of the view; left out although view is set: the default display"
    )
    ocio: Annotated[Path | str, BeforeValidator(_configuration)] | None = Field(
        None, description="OpenColorIO configuration, a file or ocio://NAME; left out: $OCIO, else OpenColorIO's default"
    )
    aovs: tuple[Aov, ...] = Field((), description="layers that are made beside the picture; docs/layers.md describes each")
    aov_format: LayerFormat = Field("exr", description="exr: layers in float32; png: a PNG file of codes for each layer")
    depth_scale: Annotated[Finite, Field(gt=0)] | None = Field(
        None,
        description="depth that one code of a PNG stands for [scene units]; left out: 1, 2 or 5 times a power of 10, as fits",
    )
    categories: tuple[str, ...] = Field(
        (), description="categories in the order of their numbers, from 1; left out: those of the scene's objects"
    )

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        size, crop = value_of(data, "size") or cls.model_fields["size"].default, value_of(data, "crop")
        if _whole_numbers(size, 2) and _whole_numbers(crop, 4):
            (width, height), (x, y, w, h) = size, crop
            if x + w > width or y + h > height:
                yield ("crop",), f"reaches to {x + w}, {y + h}, beyond the picture, which is {width} x {height}"
        aovs = value_of(data, "aovs")
        if value_of(data, "aov_format") == "png" and isinstance(aovs, list | tuple):
            for index, aov in enumerate(aovs):
                if aov in AOVS and aov not in PNG_AOVS:
                    yield ("aovs", index), f"{aov} cannot be stored as PNG, only {', '.join(PNG_AOVS)} can: use exr"
        transformed = value_of(data, "view") is not None or value_of(data, "display") is not None
        if value_of(data, "ocio") is not None and not transformed:
            yield ("ocio",), "has no effect without a view or a display"
        if transformed and value_of(data, "encoding") == "linear":
            yield ("encoding",), "linear cannot be used together with a view or a display, which encode the picture"

    @field_validator("white", mode="after")
    @classmethod
    def _visible(cls, value: Spectrum | None) -> Spectrum | None:
        if value is not None and min(value.light() @ matching()) <= 0:
            raise fault(f"{value.name} cannot be the white, because it lacks light that people see")
        return value

    @property
    def window(self) -> tuple[int, int, int, int]:
        """x, y, width and height of the window that is drawn: the crop, else the whole picture [pixels]."""
        return self.crop or (0, 0, *self.size)

    def excess(self, limits: Limits) -> str | None:
        """Returns the message that says by how much the film exceeds the limit of shaded pixels; None if it does not."""
        shaded = self.window[2] * self.window[3] * self.supersample**2
        if shaded <= limits.max_pixels:
            return None
        return f"shades {shaded:,} pixels (supersample^2 for each pixel); {limits.max_pixels:,} are allowed: see --max-pixels"

    @property
    def transformed(self) -> bool:
        """Whether 8-bit pictures go through a view transform."""
        return self.view is not None or self.display is not None

    @property
    def pictures(self) -> int:
        """The number of values that are averaged for a pixel: its samples in all the shifted pictures together."""
        return self.samples * self.supersample**2

    @property
    def direct(self) -> bool:
        """Whether shaders may write the picture's 8-bit values, because nothing is averaged or transformed afterwards."""
        return self.pictures == 1 and len(self.background) == 3 and not self.transformed


def _whole_numbers(value: Any, count: int) -> bool:
    return isinstance(value, list | tuple) and len(value) == count and all(isinstance(item, Integral) for item in value)
