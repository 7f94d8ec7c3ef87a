"""burley: Disney's diffuse model."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Parameter, Scalar, above_horizon, parameter


class Burley(Brdf):
    """kd/pi (1 + (F90-1)(1-n.l)^5) (1 + (F90-1)(1-n.v)^5) n.l with F90 = 1/2 + 2 roughness (l.h)^2.

    Its roughness is not squared. It was fitted by eye to measured materials: smooth surfaces darken at grazing angles, rough
    ones brighten there, mostly when seen from the side of the light. It is reciprocal and reflects ambient light with kd. No
    roughness makes it equal to lambert.
    """

    source: ClassVar[str] = "Burley 2012, section 5.3"
    breaks: ClassVar[Mapping[Law, str]] = {
        "energy": "it is a fit by eye, which reflects up to 1.56 times the light at grazing angles (roughness 1, kd 1)"
    }
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["burley"] = "burley"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("diffuse reflectance", high=1.0, base=True))
    roughness: Scalar = parameter(0.5, Parameter("roughness", high=1.0))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        H = l + v
        value = burley_diffuse(m.roughness, l[..., 2], v[..., 2], 0.25 * np.sum(H * H, axis=-1))
        return above_horizon(l, v, m.kd * value[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


def burley_diffuse(roughness: Array, NoL: Array, NoV: Array, LoH2: Array) -> Array:
    """Returns f cos (...) [1/sr] of Burley's diffuse lobe with reflectance 1. LoH2 (...): (l.h)^2."""
    f90 = 0.5 + 2 * roughness * LoH2
    return NoL / math.pi * (1 + (f90 - 1) * (1 - NoL) ** 5) * (1 + (f90 - 1) * (1 - NoV) ** 5)
