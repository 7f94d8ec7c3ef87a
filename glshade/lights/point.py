"""point: a light at one position that shines equally in all directions."""

from typing import Any, Literal

import numpy as np

from glshade.lights import Array, Placed, direction_and_distance


class PointLight(Placed):
    """Shines equally in all directions (lecture slide 49)."""

    type: Literal["point"] = "point"

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        toward, _ = direction_and_distance(light.position - p)
        return toward, np.broadcast_to(light.intensity, p.shape)
