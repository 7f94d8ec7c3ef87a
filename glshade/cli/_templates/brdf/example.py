"""example: diffuse reflection that fades toward the outline."""

import math
from typing import Any, ClassVar, Literal

from glshade.brdfs import Array, Brdf, Colour, Parameter, Scalar, above_horizon, parameter


class Example(Brdf):
    """kd/pi (1 - fade + fade (n.l)(n.v))."""

    # Cite the publication here: authors, year and equations.
    source: ClassVar[str] = "an example to start from"

    brdf: Literal["example"] = "example"
    # The parameters have the names and the order of the GLSL struct's members.
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance", high=1.0, base=True))
    fade: Scalar = parameter(0.5, Parameter("how much darker grazing light and grazing views are", high=1.0))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        NoL, NoV = l[..., 2:], v[..., 2:]
        fade = m.fade[..., None]
        faded = 1 - fade + fade * NoL * NoV
        return above_horizon(l, v, m.kd * faded * NoL / math.pi)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        reflectance: Array = m.kd
        return reflectance
