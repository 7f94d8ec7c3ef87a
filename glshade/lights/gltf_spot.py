"""gltf_spot: a spot light that fades as glTF's and pyrender's do."""

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from glshade.document import Direction
from glshade.lights import Array, Placed, direction_and_distance

# The narrowest edge, in cos: the extension's own, and pyrender's.
NARROWEST = 1e-3


class GltfSpotLight(Placed):
    """Whole within the inner angle, nothing past the outer, between them the square of (cos - cos outer) / (cos inner - cos
    outer): KHR_lights_punctual, inner and outer cone angles."""

    type: Literal["gltf_spot"] = "gltf_spot"
    direction: Direction = Field((0.0, -1.0, 0.0), description="the way the cone points: from the light to the scene")
    inner: Annotated[float, Field(ge=0, le=180)] = Field(
        0.0, description="from the axis to where the light begins to fade [degrees]"
    )
    outer: Annotated[float, Field(gt=0, le=180)] = Field(45.0, description="from the axis to where the light ends [degrees]")

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if isinstance(data, Mapping):
            inner, outer = data.get("inner", 0.0), data.get("outer", 45.0)
            if isinstance(inner, int | float) and isinstance(outer, int | float) and inner > outer:
                yield ("inner",), f"{inner:g} must not be larger than outer, {outer:g}"

    def uniforms(self, eye: Array) -> dict[str, Any]:
        axis, _ = direction_and_distance(-np.array(self.direction))
        # 1 - cos x = 2 sin^2(x / 2) keeps its digits for small angles.
        inner, outer = (2 * math.sin(math.radians(angle) / 2) ** 2 for angle in (self.inner, self.outer))
        scale = 1 / max(outer - inner, NARROWEST)
        return {**super().uniforms(eye), "cone_outer": outer, "axis": axis, "cone_scale": scale}

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        toward, _ = direction_and_distance(light.position - p)
        angle = 0.5 * np.sum((toward - light.axis) ** 2, axis=-1)
        x = np.clip((light.cone_outer - angle) * light.cone_scale, 0.0, 1.0)
        return toward, light.intensity * (x * x)[..., None]
