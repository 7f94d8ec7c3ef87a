"""oren_nayar: a rough surface of Lambertian facets that shadow and light each other."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert


class OrenNayar(Brdf):
    """kd/pi (C1 + C2 cos(dphi) tan(b) + C3 (1 - |cos(dphi)|) tan((a+b)/2)) n.l, plus a term in kd^2.

    The term in kd^2 is light that is reflected between facets. C1, C2 and C3 are the paper's coefficients. a and b are the
    larger and the smaller angle of l and v from the normal, and dphi is the angle between their azimuths. sigma is the standard
    deviation of the facets' slope angle [rad]; the fit is meant for up to about 1. From a sigma of 0.67 on, the fit is negative
    for dark surfaces in grazing light that are seen against the light. Negative values count as 0. The model is reciprocal and
    reflects ambient light with kd.
    """

    source: ClassVar[str] = "Oren and Nayar 1994, eqs. 27-30"
    breaks: ClassVar[Mapping[Law, str]] = {
        "energy": "the fit reflects up to 1.051 times the light at grazing angles (sigma 0.3, kd 1)"
    }

    brdf: Literal["oren_nayar"] = "oren_nayar"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("diffuse reflectance of a facet", high=1.0, base=True))
    sigma: Scalar = parameter(
        0.3, Parameter("roughness: standard deviation of the facets' slope angle", high=1.5707963, unit="rad")
    )

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        return (Limit("sigma = 0 is lambert", cls(kd=kd, sigma=0.0), Lambert(kd=kd)),)

    def canonical(self, ambient: bool) -> Brdf:
        return as_lambert(self) if self.sigma == 0.0 else self

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        NoL, NoV = np.maximum(l[..., 2], 0.0), np.maximum(v[..., 2], 0.0)
        sin_l, sin_v = np.hypot(l[..., 0], l[..., 1]), np.hypot(v[..., 0], v[..., 1])
        product = l[..., 0] * v[..., 0] + l[..., 1] * v[..., 1]
        # Along the normal there is no azimuth. Any cos(dphi) will do, because its factor is 0 there.
        cos_dphi = np.clip(product / np.maximum(sin_l * sin_v, 1e-37), -1.0, 1.0)
        # low and high are angles from the horizon. The paper's angles from the normal are alpha = pi/2 - low and
        # beta = pi/2 - high. Where both are near pi/2, low and high keep their digits.
        up_l, up_v = np.arctan2(NoL, sin_l), np.arctan2(NoV, sin_v)
        low, high = np.minimum(up_l, up_v), np.maximum(up_l, up_v)
        a, b = 1 - 2 * low / math.pi, 1 - 2 * high / math.pi
        s2 = m.sigma**2
        c1 = 1 - 0.5 * s2 / (s2 + 0.33)
        c2 = 0.45 * s2 / (s2 + 0.09)
        c3 = 0.125 * s2 / (s2 + 0.09) * (a * b) ** 2
        # sin(alpha) - b^3 = (1 - b^3) - (1 - cos(low)) with b = 1 - high / (pi/2).
        x = 2 * high / math.pi
        less = x * (3 - 3 * x + x**2) - 2 * np.sin(low / 2) ** 2
        steep = NoL * np.cos(high) / np.maximum(np.sin(high), 1e-37) * cos_dphi * np.where(cos_dphi >= 0, np.cos(low), less)
        middle = (low + high) / 2
        half = NoL * np.cos(middle) / np.maximum(np.sin(middle), 1e-37)
        one = c1 * NoL + c2 * steep + c3 * (1 - np.abs(cos_dphi)) * half
        two = 0.17 * s2 / (s2 + 0.13) * (1 - cos_dphi * b**2) * NoL
        value = m.kd / math.pi * (one[..., None] + m.kd * two[..., None])
        return above_horizon(l, v, np.maximum(value, 0.0))

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


def as_lambert(material: Any) -> Brdf:
    """Returns a lambert with the material's kd and the keys that all materials share."""
    surface = {name: getattr(material, name) for name in Brdf.model_fields if name != "brdf"}
    return Lambert.model_construct(brdf="lambert", kd=material.kd, **surface)
