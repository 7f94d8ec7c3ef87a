"""spot: a point light that shines into a cone."""

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from glshade.document import Direction
from glshade.errors import figure
from glshade.lights import Array, Placed, direction_and_distance


class SpotLight(Placed):
    """Shines fully within the inner angle and not at all beyond the outer one. Between them the light fades by a smoothstep of
    1 - cos a, where a is the angle from the axis (lecture slide 52)."""

    type: Literal["spot"] = "spot"
    direction: Direction = Field((0.0, -1.0, 0.0), description="direction of the cone's axis, from the light to the scene")
    inner: Annotated[float, Field(ge=0, le=180)] | None = Field(
        None, description="angle from the axis at which the light begins to fade; left out: two thirds of outer [degrees]"
    )
    outer: Annotated[float, Field(gt=0, le=180)] = Field(
        30.0, description="angle from the axis beyond which there is no light [degrees]"
    )

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if isinstance(data, Mapping):
            inner, outer = data.get("inner"), data.get("outer", 30.0)
            if isinstance(inner, int | float) and isinstance(outer, int | float) and inner > outer:
                yield ("inner",), f"{figure(inner)} must not be larger than outer, {figure(outer)}"

    def uniforms(self, eye: Array) -> dict[str, Any]:
        axis, _ = direction_and_distance(-np.array(self.direction))
        start = 2 * self.outer / 3 if self.inner is None else self.inner
        # For small angles 1 - cos x would lose its digits; 2 sin^2(x / 2) is equal and keeps them.
        inner, outer = (2 * math.sin(math.radians(angle) / 2) ** 2 for angle in (start, self.outer))
        # Without a least width, an edge of width 0 would divide 0 by 0. A millionth of the cone is far less than a pixel.
        width = max(outer - inner, 1e-6 * outer)
        return {**super().uniforms(eye), "cone_outer": outer, "axis": axis, "cone_scale": 1 / width}

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        toward, _ = direction_and_distance(light.position - p)
        angle = 0.5 * np.sum((toward - light.axis) ** 2, axis=-1)
        x = np.clip((light.cone_outer - angle) * light.cone_scale, 0.0, 1.0)
        return toward, light.intensity * (x * x * (3 - 2 * x))[..., None]
