"""oren_nayar_qualitative: the short form of oren_nayar."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.oren_nayar import as_lambert


class OrenNayarQualitative(Brdf):
    """kd/pi (A + B max(0, cos(dphi)) sin(a) tan(b)) n.l with A = 1 - s^2/2/(s^2 + 0.33), B = 0.45 s^2/(s^2 + 0.09), s = sigma.

    The angles are those of oren_nayar. The model is reciprocal and reflects ambient light with kd. Widely copied code has two
    faults: A = 1 + s^2 (...), which is 3.6 times too bright at sigma 1; and l.v clamped to [eps, 1], which adds up to B where l
    and v graze the surface on opposite sides.
    """

    source: ClassVar[str] = "Oren and Nayar 1994, eq. 31"
    breaks: ClassVar[Mapping[Law, str]] = {
        "energy": "the fit reflects up to 1.016 times the light at grazing angles (sigma 0.2, kd 1)"
    }
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["oren_nayar_qualitative"] = "oren_nayar_qualitative"
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
        # The dot product of the parts of l and v across the normal is cos(dphi) sin(a) sin(b).
        across = l[..., 0] * v[..., 0] + l[..., 1] * v[..., 1]
        s2 = m.sigma**2
        a = 1 - 0.5 * s2 / (s2 + 0.33)
        b = 0.45 * s2 / (s2 + 0.09)
        value = a * NoL + b * np.maximum(across, 0.0) * (NoL / np.maximum(np.maximum(NoL, NoV), 1e-37))
        return above_horizon(l, v, m.kd / math.pi * value[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
