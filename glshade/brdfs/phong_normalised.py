"""phong_normalised: phong with a lobe whose albedo at normal incidence is ks."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.phong import power_of_cosine, with_half_angle, without_lobe


class PhongNormalised(Brdf):
    """(kd/pi + ks (p + 2)/(2 pi) max(r.v, 0)^p) n.l with r = 2 (n.l) n - l, where p is the exponent.

    It is reciprocal and reflects ambient light with kd. The albedo is kd + ks at normal incidence, and less where the horizon
    cuts the lobe.
    """

    source: ClassVar[str] = "Lafortune and Willems 1994; Lewis 1993"
    shares: ClassVar[tuple[str, ...]] = ("kd", "ks")
    linear: ClassVar[tuple[str, ...]] = ("kd", "ks")

    brdf: Literal["phong_normalised"] = "phong_normalised"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance", base=True))
    ks: Colour = parameter((0.3, 0.3, 0.3), Parameter("specular reflectance: the lobe's albedo at normal incidence"))
    exponent: Scalar = parameter(32.0, Parameter("narrowness of the lobe, p", high=1e8, usual=(1.0, 1000.0)))

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        return (Limit("ks = 0 is lambert", cls(kd=kd, ks=(0.0, 0.0, 0.0)), Lambert(kd=kd)),)

    def canonical(self, ambient: bool) -> Brdf:
        return without_lobe(self, ambient)

    def half_angle(self) -> Brdf:
        return with_half_angle(self, "blinn_phong_normalised")

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        # In the local frame the mirror direction is l with x and y negated.
        r = np.concatenate([-l[..., :2], l[..., 2:]], axis=-1)
        lobe = (m.exponent + 2) / (2 * math.pi) * power_of_cosine(r, v, m.exponent)
        return above_horizon(l, v, (m.kd / math.pi + m.ks * lobe[..., None]) * l[..., 2:])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
