"""gltf_spot: a spot light that fades at its edge like the spot lights of glTF and pyrender."""

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from glshade.document import Direction
from glshade.errors import figure
from glshade.lights import Array, Placed, direction_and_distance

# The least difference of the cosines of the inner and outer angle. KHR_lights_punctual and pyrender use the same.
NARROWEST = 1e-3


class GltfSpotLight(Placed):
    """Shines fully within the inner angle and not at all beyond the outer one. Between them the light is multiplied by the
    square of (cos a - cos outer) / (cos inner - cos outer), where a is the angle from the axis, as in KHR_lights_punctual,
    "Inner and Outer Cone Angles"."""

    type: Literal["gltf_spot"] = "gltf_spot"
    direction: Direction = Field((0.0, -1.0, 0.0), description="direction of the cone's axis, from the light to the scene")
    inner: Annotated[float, Field(ge=0, le=180)] = Field(
        0.0, description="angle from the axis at which the light begins to fade [degrees]"
    )
    outer: Annotated[float, Field(gt=0, le=180)] = Field(
        45.0, description="angle from the axis beyond which there is no light [degrees]"
    )

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if isinstance(data, Mapping):
            inner, outer = data.get("inner", 0.0), data.get("outer", 45.0)
            if isinstance(inner, int | float) and isinstance(outer, int | float) and inner > outer:
                yield ("inner",), f"{figure(inner)} must not be larger than outer, {figure(outer)}"

    def uniforms(self, eye: Array) -> dict[str, Any]:
        axis, _ = direction_and_distance(-np.array(self.direction))
        # For small angles 1 - cos x would lose its digits; 2 sin^2(x / 2) is equal and keeps them.
        inner, outer = (2 * math.sin(math.radians(angle) / 2) ** 2 for angle in (self.inner, self.outer))
        scale = 1 / max(outer - inner, NARROWEST)
        return {**super().uniforms(eye), "cone_outer": outer, "axis": axis, "cone_scale": scale}

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        toward, _ = direction_and_distance(light.position - p)
        angle = 0.5 * np.sum((toward - light.axis) ** 2, axis=-1)
        x = np.clip((light.cone_outer - angle) * light.cone_scale, 0.0, 1.0)
        return toward, light.intensity * (x * x)[..., None]
