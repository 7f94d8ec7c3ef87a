"""Lights: the types of light of a scene file, one module each, which is found by its presence.

Each light has a GLSL file of the same name under shaders/light/. Its intensity I is the radiance of a white Lambertian surface
that faces it, at distance 1 if the light falls off. So a surface reflects pi (f cos) I falloff, where f cos is
the BRDF times n.l. The intensity may be negative.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag

from glshade.arrays import unit_and_length
from glshade.document import Document, Finite, Triple
from glshade.found import Found
from glshade.optics.spectra import Spectrum, is_spectrum

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FalloffLaw:
    """A law by which light weakens with the distance r.

    power: the light is divided by r to this power.
    name: the name of the law's GLSL file under shaders/falloff/, which is also the end of its function's name; empty where
        the light does not weaken.
    """

    power: int
    name: str


Falloff = Literal["none", "1/r", "1/r^2"]
FALLOFFS: Mapping[Falloff, FalloffLaw] = {
    "none": FalloffLaw(0, ""),
    "1/r": FalloffLaw(1, "inverse"),
    "1/r^2": FalloffLaw(2, "inverse_square"),
}


# The colour of a light: three numbers (one number stands for three equal ones) or a spectrum.
LightColour = Annotated[
    Annotated[Triple, Tag("<value>")] | Annotated[Spectrum, Tag("<spectrum-table>")],
    Discriminator(lambda value: "<spectrum-table>" if is_spectrum(value) or isinstance(value, Mapping) else "<value>"),
]


class Light(Document):
    """The keys that every light has."""

    type: str
    name: str | None = Field(None, description="name of the light, for messages and dotted keys")
    colour: LightColour = Field((1.0, 1.0, 1.0), description="colour of the light, linear Rec. 709, or its spectrum")
    intensity: Finite = Field(1.0, description="multiplies the colour; negative light takes light away")
    only: tuple[str, ...] | None = Field(None, description="names of the only objects that it lights; left out: all objects")

    # An omnidirectional light reaches a surface from all sides. A surface shows illuminate(light, n) times its model's ambient
    # reflectance.
    omnidirectional: ClassVar[bool] = False
    # Whether an omnidirectional light is the same for every normal. All such lights are added up to one colour before drawing.
    ignores_normal: ClassVar[bool] = False

    @property
    def is_negative(self) -> bool:
        """Whether the light takes light away in at least one channel."""
        return min(c * self.intensity for c in self.rgb) < 0

    @property
    def rgb(self) -> tuple[float, float, float]:
        """The colour, linear Rec. 709. Errors: AssetError for a spectrum that cannot be read."""
        return self.colour.colour(lit=False) if isinstance(self.colour, Spectrum) else self.colour

    @classmethod
    def fields(cls) -> dict[str, str]:
        """Returns the fields of the light's GLSL struct in their order: name -> "vec3" or "float"."""
        # The types can be read from the uniforms of any light of the class. A light with a position cannot be made
        # without a position.
        anywhere = {"position": (0.0, 0.0, 0.0)} if "position" in cls.model_fields else {}
        values = cls.model_validate(anywhere).uniforms(np.zeros(3))
        return {name: "vec3" if np.size(value) == 3 else "float" for name, value in values.items()}

    def scaled(self, unit: float) -> "Light":
        """Returns the light that gives the same picture where every length of the scene is multiplied by `unit`."""
        return self

    def uniforms(self, eye: Array) -> dict[str, Any]:
        """Returns the values of the GLSL struct's fields in their order, in float64.

        eye: the origin of camera-relative space (3,), which positions are made relative to [scene units].
        """
        return {"intensity": np.multiply(self.rgb, self.intensity)}

    @staticmethod
    def illuminate(light: Any, where: Array) -> Any:
        """Returns the light that arrives at points of a surface, in float64.

        The shape (..., 3) stands for any leading shape with three columns.
        A directed light returns a pair (l, e): the unit directions to the light (..., 3), and the light's strength (..., 3)
        before falloff. An omnidirectional light returns the strength (..., 3) that multiplies the model's ambient reflectance.
        light: an object whose attributes are the fields of `uniforms`.
        where: for a directed light, the points (..., 3) relative to the eye [scene units]; for an omnidirectional light, the
            unit normals (..., 3).
        """
        raise NotImplementedError


class Placed(Light):
    """The keys that every light with a position has."""

    position: tuple[Finite, Finite, Finite] = Field(description="position of the light [scene units]")
    falloff: Falloff = Field("1/r^2", description="how the light weakens with distance: none, 1/r, or the physical 1/r^2")
    r_min: Annotated[float, Field(gt=0)] = Field(
        1e-3, description="the light grows no brighter within this distance [scene units]"
    )

    def scaled(self, unit: float) -> Light:
        # At distances that are `unit` times as long, the light has to be stronger by the falloff's power to look the same.
        gain = unit ** FALLOFFS[self.falloff].power
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
    """Returns the unit directions (..., 3) and the lengths (...) [scene units] of the vectors to a light (..., 3).

    At the light itself the direction is (0, 0, 0), so that no light arrives there.
    """
    return unit_and_length(to_light)


LIGHTS: Found[Light] = Found("glshade.lights", Path(__file__).parent, suffix="Light")
