"""retro_ggx: a retro-reflective microfacet lobe over a diffuse base."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Parameter, Scalar, Slot, above_horizon, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.metal import cos_half
from glshade.optics.fresnel import f_schlick, t_schlick
from glshade.optics.microfacet import ggx_cos


class RetroGgx(Brdf):
    """kd/pi T(n.l) T(n.v) n.l + F(v.k) D(k) G2(l, v) / (4 n.v) with k = (v + r)/|v + r|, r = 2 (n.l) n - l and T = 1 - F.

    The back vector k replaces h. Where l = v, k is n. D and G2 are those of ggx, and F is Schlick's Fresnel term with the
    reflectance ks at normal incidence. The diffuse part gets the light that the mean surface transmits on the way in and on the
    way out (Shirley et al. 1997). The model is reciprocal, because exchanging l and v mirrors k at n. It reflects ambient light
    with kd. Where v = -r, which means that l = v in the horizon, there is no back vector, and the specular part is 0.
    """

    source: ClassVar[str] = "Belcour et al. 2014, eq. 3; Walter et al. 2007, eqs. 20, 33; Heitz 2014, eq. 99; lecture slide 6"
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"roughness": 0.5},
        {"roughness": 0.6},
        {"roughness": 0.8},
        {"roughness": 1.0},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["retro_ggx"] = "retro_ggx"
    kd: Colour = parameter((0.3, 0.3, 0.3), Parameter("diffuse reflectance", high=1.0, base=True))
    ks: Colour = parameter((0.5, 0.5, 0.5), Parameter("retro-reflectance at normal incidence", high=1.0))
    roughness: Scalar = parameter(
        0.3, Parameter("square root of alpha, the width of the lobe; below 0.01 it counts as 0.01", high=1.0, usual=(0.1, 1.0))
    )

    def slots(self) -> dict[str, Slot]:
        diffuse = "none" if self.kd == (0.0, 0.0, 0.0) else "under_schlick"
        return {"diffuse": Slot((f"microfacet/diffuse_{diffuse}.glsl",))}

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        return super().asked(by) - ({"kd"} if by == "light" and self.kd == (0.0, 0.0, 0.0) else set())

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        r = l * np.array([-1.0, -1.0, 1.0])
        k, length2 = half_vector(r, v)
        lobe = np.where(length2 > 1e-12, ggx_cos(r, v, k, m.roughness), 0.0)
        # A direction below the horizon gives 0 in the end. Clamping keeps the intermediate values finite.
        NoL, NoV = np.maximum(l[..., 2], 0), np.maximum(v[..., 2], 0)
        diffuse = m.kd / math.pi * t_schlick(1 - m.ks, NoL) * t_schlick(1 - m.ks, NoV) * NoL[..., None]
        return above_horizon(l, v, diffuse + f_schlick(m.ks, cos_half(length2)) * lobe[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
