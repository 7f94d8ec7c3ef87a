"""Quality: what may be traded for speed, each choice of one kind. A table of the scene file, for all or for one object."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from glshade.brdfs import Brdf
from glshade.document import Document, number

Storage = Literal["auto", "rgba8", "rgb10_a2", "r11f_g11f_b10f", "rgba16f", "rgba32f"]
# Beyond, a triangle has become 65,536.
MOST_LEVELS = 8


class Quality(Document):
    """Model, sampling, arithmetic, storage: what is left out stays as the scene has it. An object's own come before these."""

    fresnel: Literal["exact", "schlick"] | None = Field(
        None, description="model: reflection at an interface, by materials that know both"
    )
    specular: Literal["mirror", "half_angle"] | None = Field(
        None, description="model: half_angle puts blinn_phong in phong's place, at four times the exponent"
    )
    shading: Literal["flat", "gouraud", "phong"] | None = Field(
        None, description="sampling: where the model is evaluated; comes before an object's own shading"
    )
    subdivide: Annotated[int, Field(ge=0, le=MOST_LEVELS), BeforeValidator(number)] | None = Field(
        None, description="sampling: times that every triangle is cut in four, where shading is per face or per vertex"
    )
    refine: Annotated[float, Field(gt=0), BeforeValidator(number)] | None = Field(
        None, description="sampling: per vertex, triangles are cut where interpolated light is off by more than this"
    )
    normalise: bool | None = Field(None, description="sampling: whether an interpolated normal is made unit in every pixel")
    arithmetic: Literal["stable", "fast"] | None = Field(
        None, description="arithmetic: fast takes powers and distributions by their textbook forms"
    )
    storage: Storage | None = Field(
        None, description="storage: what linear light is kept in before it is encoded; of the whole picture only"
    )

    def over(self, other: Quality) -> Quality:
        """These, and the other's where these say nothing."""
        said = {name: getattr(self, name) for name in type(self).model_fields if getattr(self, name) is not None}
        return other.model_copy(update=said) if said else other

    def material(self, material: Brdf) -> Brdf:
        """The material as the choices of model would have it."""
        if self.specular == "half_angle":
            material = material.half_angle()
        if self.fresnel is not None and "fresnel" in material.choices():
            material = material.model_copy(update={"fresnel": self.fresnel})
        return material
