"""ambient: a light that is the same from all directions."""

from typing import Any, ClassVar, Literal

import numpy as np

from glshade.lights import Array, Light


class AmbientLight(Light):
    """Adds its intensity times the material's ambient reflectance, in place of all indirect light (lecture slide 23)."""

    type: Literal["ambient"] = "ambient"
    omnidirectional: ClassVar[bool] = True
    ignores_normal: ClassVar[bool] = True

    @staticmethod
    def illuminate(light: Any, n: Array) -> Array:
        return np.broadcast_to(light.intensity, n.shape)
