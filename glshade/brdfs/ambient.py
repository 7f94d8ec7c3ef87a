"""ambient: reflects only ambient light."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Parameter, parameter


class Ambient(Brdf):
    """Its colour is ka times the ambient light. f cos is 0, so other lights have no effect."""

    source: ClassVar[str] = "lecture slides 12, 23"
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"ka": 1},
        {"ka": 3},
        {"ka": 6},
        {"ka": 10},
    )
    linear: ClassVar[tuple[str, ...]] = ("ka",)

    brdf: Literal["ambient"] = "ambient"
    ka: Colour = parameter((0.8, 0.8, 0.8), Parameter("ambient reflectance", base=True))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        return np.zeros(np.broadcast_shapes(l.shape, v.shape))

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.ka  # type: ignore[no-any-return]
