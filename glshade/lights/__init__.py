"""The lights: one module each, found by its presence, beside one GLSL file of the same name.

A light's intensity I is the radiance that a white Lambertian facing it would show (at distance 1 where it falls off), so a
surface reflects pi (f cos) I falloff. It may be negative.
"""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from glshade.document import Document, Finite, Triple
from glshade.found import Found

Array = NDArray[np.float64]
Falloff = Literal["none", "1/r", "1/r^2"]


class Light(Document):
    """What every light has."""

    type: str
    name: str | None = Field(None, description="for messages")
    colour: Triple = Field((1.0, 1.0, 1.0), description="linear Rec. 709")
    intensity: Finite = Field(1.0, description="multiplies the colour; negative light takes light away")
    only: tuple[str, ...] | None = Field(None, description="names of the only objects it lights; left out: all")

    # A light without a direction adds `ambient reflectance x intensity`, and has no illuminate().
    omnidirectional: ClassVar[bool] = False

    @property
    def is_negative(self) -> bool:
        """Whether it takes light away in some channel."""
        return min(c * self.intensity for c in self.colour) < 0

    @classmethod
    def fields(cls) -> dict[str, str]:
        """The GLSL struct's fields in their order: name -> vec3 or float."""
        anywhere = {"position": (0.0, 0.0, 0.0)} if "position" in cls.model_fields else {}
        values = cls.model_validate(anywhere).uniforms(np.zeros(3))
        return {name: "vec3" if np.size(value) == 3 else "float" for name, value in values.items()}

    def scaled(self, unit: float) -> "Light":
        """The light of the same picture with all lengths times `unit`."""
        return self

    def uniforms(self, eye: Array) -> dict[str, Any]:
        """The GLSL struct's fields in their order, float64; positions relative to `eye` (3,)."""
        return {"intensity": np.multiply(self.colour, self.intensity)}

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        """(l, e): unit directions to the light and its strength before falloff, (..., 3), at the points p (..., 3)."""
        raise NotImplementedError


class Placed(Light):
    """What every light at a place has."""

    position: tuple[Finite, Finite, Finite] = Field(description="where it is [scene units]")
    falloff: Falloff = Field("1/r^2", description="how it weakens with distance: none, 1/r, or the physical 1/r^2")
    r_min: Annotated[float, Field(gt=0)] = Field(1e-3, description="within this distance it grows no brighter [scene units]")

    def scaled(self, unit: float) -> Light:
        # What falls off by a power of the distance shines stronger by that power.
        gain = {"none": 1.0, "1/r": unit, "1/r^2": unit * unit}[self.falloff]
        return self.model_copy(
            update={
                "position": tuple(c * unit for c in self.position),
                "r_min": self.r_min * unit,
                "intensity": self.intensity * gain,
            }
        )

    def uniforms(self, eye: Array) -> dict[str, Any]:
        return {**super().uniforms(eye), "r_min": self.r_min, "position": np.subtract(self.position, eye)}


def direction_and_distance(to_light: Array) -> tuple[Array, Array]:
    """(..., 3) unit, (...) [scene units]; at the light itself the direction is (0, 0, 0): no light."""
    scale = np.max(np.abs(to_light), axis=-1, keepdims=True)
    scaled = to_light / np.where(scale > 0, scale, 1.0)
    length = np.linalg.norm(scaled, axis=-1, keepdims=True)
    return scaled / np.where(length > 0, length, 1.0), (length * scale)[..., 0]


LIGHTS: Found[Light] = Found("glshade.lights", Path(__file__).parent, suffix="Light")
