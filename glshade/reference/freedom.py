"""Freedom: how far a driver may deviate from the reference within the OpenGL specification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from pydantic import TypeAdapter, ValidationError

from glshade.errors import GlshadeError
from glshade.radiance.sampler import Rule
from glshade.reference.raster import RESERVE, SUBPIXELS, WINDOW

# The least number of sub-pixel bits that OpenGL allows (SUBPIXEL_BITS in OpenGL 3.3 core's tables of
# implementation dependent values).
LEAST_BITS = 4
# No driver is known to have more sub-pixel bits than this. A grid finer than the reference's changes nothing.
MOST_BITS = 32


@dataclass(frozen=True)
class Freedom:
    """The errors of a driver's fixed functions. docs/tolerance.md explains how they are measured.

    name: the name of the driver.
    plane: the error of an attribute's plane equation (K in docs/tolerance.md) [roundings].
    window: the error of a vertex's window position (k in docs/tolerance.md) [roundings].
    snap: the distance by which a corner is moved before attributes are interpolated [pixels]; 0 if they are interpolated from
        the exact corners.
    rules: the rules for the level of detail between whose results the driver's level lies. One rule is enough if it was
        recognised.
    level: the error of the level of detail, below the least and above the largest result of these rules [levels].
    texel: the error of the texture filter's weights [texels]; 0 if it is not larger than that of float32.
    table: the same for the textures of three dimensions that hold the tables of models [texels].
    clips: whether triangles are clipped at the sides of the view, and not only at the near and far plane.
    subpixel_bits: the number of binary digits below one pixel of the corners' coordinates that decide which pixels a triangle
        covers.
    samples: the largest number of samples per pixel that the driver offers in one picture; 0 if it is not known.
    codes: the error of the conversion from floats to 8-bit codes, between 0.5 and 1 [codes].
    decoding: the largest error with which the 8-bit sRGB codes of textures are decoded to linear values [codes].
    decoded: the linear value (256,) of each of these codes, as the driver decodes it. The error needs no allowance where these
        values are known; none are given where they are not.
    """

    name: str = "llvmpipe"
    plane: float = 2.0
    window: float = WINDOW
    snap: float = 0.0
    rules: tuple[Rule, ...] = ("length",)
    level: float = 0.05
    texel: float = 0.0
    table: float = 0.0
    clips: bool = True
    subpixel_bits: int = 8
    samples: int = 4
    codes: float = 0.51
    decoding: float = 0.4
    decoded: tuple[float, ...] = ()

    @property
    def step(self) -> float:
        """The largest distance by which the driver or the reference moves a corner to its grid [pixels]."""
        return max(2.0**-self.subpixel_bits, 1 / SUBPIXELS)

    @property
    def margin(self) -> float:
        """The distance of a triangle's edge from a point below which a driver may cover the point or not [1/256 pixel]."""
        return self.step * SUBPIXELS + RESERVE

    def as_dict(self) -> dict[str, Any]:
        """Returns the errors in a form that JSON can hold. `decoding` stands for the values of the sRGB codes."""
        result = {**asdict(self), "rules": list(self.rules)}
        del result["decoded"]
        return result

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Freedom:
        """Returns the Freedom of a dictionary that `as_dict` has made; keys that are missing have their default values.

        Errors: GlshadeError, in one line, where a key is unknown or a value is not allowed.
        """
        unknown = sorted(set(data) - (set(cls.__dataclass_fields__) - {"decoded"}))
        if unknown:
            raise GlshadeError(f"freedom.{unknown[0]}: no such property of a driver; remove it")
        try:
            found = TypeAdapter(cls).validate_python(dict(data))
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, ("freedom", *first["loc"])))
            raise GlshadeError(f"{place}: {first['msg'][0].lower()}{first['msg'][1:]}, not {first['input']!r}") from None
        errors = ("plane", "window", "snap", "level", "texel", "table", "codes", "decoding")
        numbers = {name: getattr(found, name) for name in errors}
        for name, value in numbers.items():
            if not 0 <= value < float("inf"):
                raise GlshadeError(f"freedom.{name}: must be a finite number from 0, not {value}")
        if not LEAST_BITS <= found.subpixel_bits <= MOST_BITS:
            raise GlshadeError(f"freedom.subpixel_bits: must be from {LEAST_BITS} to {MOST_BITS}, not {found.subpixel_bits}")
        if found.samples < 0:
            raise GlshadeError(f"freedom.samples: must be at least 0, not {found.samples}")
        if not found.rules:
            raise GlshadeError("freedom.rules: must name at least one rule")
        return found


# The errors of Mesa's llvmpipe. `glshade verify` uses the errors that it measures in their place (glshade/driver/freedom.py).
LLVMPIPE = Freedom()
# The errors that a driver may have that was not measured: corners are snapped to the coarsest grid that OpenGL allows,
# attributes are interpolated from the corners before or after that, the level of detail is any that the specification allows,
# texture filters have weights of 8 bits, a float becomes one of the two codes nearest to it, and an sRGB code is decoded to a
# number that is nearer to the code's own than to any other's. (OpenGL does not say how exact the decoding is.)
UNMEASURED = Freedom(
    "unmeasured",
    snap=2.0**-LEAST_BITS,
    rules=("largest", "sum"),
    level=0.1,
    texel=1 / 256,
    table=1 / 256,
    subpixel_bits=LEAST_BITS,
    samples=0,
    codes=1.0,
    decoding=0.5,
)
