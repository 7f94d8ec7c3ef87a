"""lambert: ideal diffuse reflection."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from glshade.brdfs import Array, Brdf, Colour, Parameter, above_horizon, parameter


class Lambert(Brdf):
    """kd/pi n.l. Light from behind the surface gives 0, not the absolute value. The model reflects ambient light with kd."""

    source: ClassVar[str] = "Lambert 1760; lecture slides 13-15"
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"kd": 0.1},
        {"kd": 0.3},
        {"kd": 0.6},
        {"kd": 1.0},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["lambert"] = "lambert"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("diffuse reflectance (albedo)", base=True))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        return above_horizon(l, v, m.kd * l[..., 2:] / math.pi)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
