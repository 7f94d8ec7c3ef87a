"""ashikhmin_shirley: an anisotropic Phong model with Fresnel and an energy-conserving diffuse term."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.blinn_phong import half_vector


class AshikhminShirley(Brdf):
    """An anisotropic specular lobe with Schlick's Fresnel over an energy-conserving diffuse term.

    It is reciprocal and reflects ambient light with kd. kd and ks may both be 1, because the diffuse term shrinks as the
    specular one grows.

    Lecture slide 42 has (n.u)^2 and (n.v)^2 in the exponent, which are 0. Here they are (h.u)^2 and (h.v)^2, as in the paper.
    """

    source: ClassVar[str] = "Ashikhmin and Shirley 2000, eqs. 1-5; lecture slides 40-46"
    isotropic_where: ClassVar[dict[str, str | float]] = {"pv": "pu"}
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"pu": 10, "pv": 10},
        {"pu": 100, "pv": 100},
        {"pu": 1000, "pv": 1000},
        {"pu": 10, "pv": 1000},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["ashikhmin_shirley"] = "ashikhmin_shirley"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance", high=1.0, base=True))
    ks: Colour = parameter((0.05, 0.05, 0.05), Parameter("specular reflectance at normal incidence", high=1.0))
    pu: Scalar = parameter(100.0, Parameter("narrowness of the lobe along the tangent", high=1e8, usual=(1.0, 10000.0)))
    pv: Scalar = parameter(100.0, Parameter("narrowness of the lobe along the bitangent", high=1e8, usual=(1.0, 10000.0)))

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        NoL, NoV, NoH = l[..., 2], v[..., 2], h[..., 2]
        # l.h = |H| / 2 for unit vectors. A dot product would suffer from the rounding of |l| and |v| near l = -v.
        LoH = np.minimum(0.5 * np.sqrt(length2), 1.0)
        sin2 = h[..., 0] ** 2 + h[..., 1] ** 2
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            # This is log(n.h) / sin^2. At h = n it is 0/0, and the limit -1/2 replaces it.
            log_ratio = np.where(
                sin2 < 0.5, np.where(sin2 > 0, np.log1p(-np.minimum(sin2, 0.5)) / (2 * sin2), -0.5), np.log(NoH) / sin2
            )
            lobe = np.exp((m.pu * h[..., 0] ** 2 + m.pv * h[..., 1] ** 2) * log_ratio)
            norm = np.sqrt((m.pu + 1) * (m.pv + 1)) / (8 * math.pi)
            scale = norm * lobe * NoL / (LoH * np.maximum(NoL, NoV))
        fresnel = m.ks + (1 - m.ks) * ((1 - LoH) ** 5)[..., None]
        specular = np.where((length2 > 1e-12)[..., None], fresnel * scale[..., None], 0.0)
        rise = (1 - (1 - NoL / 2) ** 5) * (1 - (1 - NoV / 2) ** 5) * NoL
        diffuse = 28 / (23 * math.pi) * m.kd * (1 - m.ks) * rise[..., None]
        return above_horizon(l, v, diffuse + specular)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
