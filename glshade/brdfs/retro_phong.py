"""retro_phong: a cosine lobe around the direction to the light."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from glshade.brdfs import Array, Brdf, Colour, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.phong import power_of_cosine, without_lobe


class RetroPhong(Brdf):
    """(kd/pi + ks (p + 2)/(2 pi) max(l.v, 0)^p) n.l, where p is the exponent.

    It is phong_normalised with the viewer mirrored at the normal, so it is reciprocal and has the same albedo. It reflects
    ambient light with kd.
    """

    source: ClassVar[str] = "Lafortune et al. 1997 (lobe C = (1, 1, 1)); lecture slide 6"
    shares: ClassVar[tuple[str, ...]] = ("kd", "ks")
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"exponent": 1},
        {"exponent": 4},
        {"exponent": 16},
        {"exponent": 64},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd", "ks")

    brdf: Literal["retro_phong"] = "retro_phong"
    kd: Colour = parameter((0.3, 0.3, 0.3), Parameter("diffuse reflectance", base=True))
    ks: Colour = parameter((0.5, 0.5, 0.5), Parameter("retro-reflectance: the lobe's albedo at normal incidence"))
    exponent: Scalar = parameter(32.0, Parameter("narrowness of the lobe, p", high=1e8, usual=(1.0, 1000.0)))

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
        lobe = (m.exponent + 2) / (2 * math.pi) * power_of_cosine(l, v, m.exponent)
        return above_horizon(l, v, (m.kd / math.pi + m.ks * lobe[..., None]) * l[..., 2:])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
