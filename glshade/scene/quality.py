"""Quality: the choices between speed and accuracy, for a whole scene or for one object."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from glshade.brdfs import Brdf
from glshade.document import Document, number

Storage = Literal["auto", "rgba8", "rgb10_a2", "r11f_g11f_b10f", "rgba16f", "rgba32f"]
# The largest number of subdivisions. After 8 of them a triangle has become 4^8 = 65,536 triangles.
MOST_LEVELS = 8


class Quality(Document):
    """Choices of model, sampling, arithmetic and storage. A key that is left out changes nothing. An object's own quality
    replaces the scene's key by key."""

    fresnel: Literal["exact", "schlick"] | None = Field(
        None, description="model: formula for the reflection at an interface, for materials that have both"
    )
    specular: Literal["mirror", "half_angle"] | None = Field(
        None, description="model: half_angle replaces phong by blinn_phong with four times the exponent"
    )
    shading: Literal["flat", "gouraud", "phong"] | None = Field(
        None, description="sampling: where the model is evaluated; replaces the shading of objects"
    )
    subdivide: Annotated[int, Field(ge=0, le=MOST_LEVELS), BeforeValidator(number)] | None = Field(
        None, description="sampling: how many times each triangle is cut into four, if shading is per face or per vertex"
    )
    refine: Annotated[float, Field(gt=0), BeforeValidator(number)] | None = Field(
        None, description="sampling: if shading is per vertex, triangles are cut where the interpolated light's error is larger"
    )
    normalise: bool | None = Field(None, description="sampling: whether interpolated normals are made unit in every pixel")
    arithmetic: Literal["stable", "fast"] | None = Field(
        None, description="arithmetic: fast uses the textbook forms of powers and distributions, which lose more digits"
    )
    storage: Storage | None = Field(
        None, description="storage: pixel format of linear light before it is encoded, for the whole picture only"
    )

    def over(self, other: Quality) -> Quality:
        """Returns the other quality with the keys replaced that this one sets."""
        own = {name: getattr(self, name) for name in type(self).model_fields if getattr(self, name) is not None}
        return other.model_copy(update=own) if own else other

    def material(self, material: Brdf) -> Brdf:
        """Returns the material with the choices `specular` and `fresnel` applied."""
        if self.specular == "half_angle":
            material = material.half_angle()
        if self.fresnel is not None and "fresnel" in material.choices():
            material = material.model_copy(update={"fresnel": self.fresnel})
        return material
