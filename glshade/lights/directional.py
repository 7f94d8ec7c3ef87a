"""directional: a light at infinity."""

from typing import Any, Literal

import numpy as np
from pydantic import Field

from glshade.document import Direction
from glshade.lights import Array, Light, direction_and_distance


class DirectionalLight(Light):
    """Has the same direction and strength everywhere (lecture slide 49)."""

    type: Literal["directional"] = "directional"
    direction: Direction = Field(
        (-0.4, -0.6, -0.7), description="direction in which the light travels, from the light to the scene"
    )

    def uniforms(self, eye: Array) -> dict[str, Any]:
        toward, _ = direction_and_distance(-np.array(self.direction))
        return {**super().uniforms(eye), "l": toward}

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        return np.broadcast_to(light.l, p.shape), np.broadcast_to(light.intensity, p.shape)
