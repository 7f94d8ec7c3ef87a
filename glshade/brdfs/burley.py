"""burley: Disney's diffuse."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Parameter, Scalar, above_horizon, parameter


class Burley(Brdf):
    """kd/pi (1 + (F90-1)(1-n.l)^5) (1 + (F90-1)(1-n.v)^5) n.l, F90 = 1/2 + 2 roughness (l.h)^2. Takes roughness, not alpha.

    A fit by eye to measured materials: smooth surfaces darken at grazing angles, rough ones brighten towards the light.
    Reciprocal. Reflects ambient light with kd. At no roughness is it lambert.
    """

    source: ClassVar[str] = "Burley 2012, section 5.3"
    breaks: ClassVar[Mapping[Law, str]] = {
        "energy": "fitted by eye: gives back up to 1.56 of grazing light, at roughness 1 and kd 1"
    }

    brdf: Literal["burley"] = "burley"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("diffuse reflectance", high=1.0, base=True))
    roughness: Scalar = parameter(0.5, Parameter("roughness", high=1.0))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        H = l + v
        value = burley(m.roughness, l[..., 2], v[..., 2], 0.25 * np.sum(H * H, axis=-1))
        return above_horizon(l, v, m.kd * value[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


def burley(roughness: Array, NoL: Array, NoV: Array, LoH2: Array) -> Array:
    """f cos (...) of the lobe with reflectance 1; LoH2 = (l.h)^2."""
    f90 = 0.5 + 2 * roughness * LoH2
    return NoL / math.pi * (1 + (f90 - 1) * (1 - NoL) ** 5) * (1 + (f90 - 1) * (1 - NoV) ** 5)
