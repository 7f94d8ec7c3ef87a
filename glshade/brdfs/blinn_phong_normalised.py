"""blinn_phong_normalised: blinn_phong with a lobe whose albedo at normal incidence is ks."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.phong import power_of_cosine, without_lobe


class BlinnPhongNormalised(Brdf):
    """(kd/pi + ks c(p) max(n.h, 0)^p) n.l with c(p) = (p + 2)(p + 4) / (8 pi (2^(-p/2) + p)), where p is the exponent.

    c makes the lobe's albedo at normal incidence ks for every p. With v = n and t the angle to l, n.h = u = cos(t/2),
    n.l = 2 u^2 - 1 and the solid angle dw = 2 pi sin t dt = 8 pi u du, so that 1/c is the integral of 8 pi u^(p+1) (2 u^2 - 1)
    over u from 1/sqrt 2 to 1. The common factor (p + 8)/(8 pi) is up to 7.5 % too large. The model is reciprocal and reflects
    ambient light with kd. Towards grazing angles the lobe loses light.
    """

    source: ClassVar[str] = "Blinn 1977; normalised after Giesen 2009"
    shares: ClassVar[tuple[str, ...]] = ("kd", "ks")
    linear: ClassVar[tuple[str, ...]] = ("kd", "ks")

    brdf: Literal["blinn_phong_normalised"] = "blinn_phong_normalised"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance", base=True))
    ks: Colour = parameter((0.3, 0.3, 0.3), Parameter("specular reflectance: the lobe's albedo at normal incidence"))
    exponent: Scalar = parameter(128.0, Parameter("narrowness of the lobe, p", high=1e8, usual=(1.0, 1000.0)))

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        return (Limit("ks = 0 is lambert", cls(kd=kd, ks=(0.0, 0.0, 0.0)), Lambert(kd=kd)),)

    def canonical(self, ambient: bool) -> Brdf:
        return without_lobe(self, ambient)

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        p = m.exponent
        norm = (p + 2) * (p + 4) / (8 * math.pi * (np.exp2(-p / 2) + p))
        up = np.array([0.0, 0.0, 1.0], dtype=h.dtype)
        lobe = np.where(length2 > 1e-12, norm * power_of_cosine(up, h, p), 0.0)
        return above_horizon(l, v, (m.kd / math.pi + m.ks * lobe[..., None]) * l[..., 2:])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
