"""minnaert: surfaces that darken or brighten towards their outline."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.ward import GRAZING


class Minnaert(Brdf):
    """kd (k + 1)/(2 pi) ((n.l) (n.v))^(k - 1) n.l. It is reciprocal and reflects ambient light with kd.

    The albedo is kd (n.v)^(k - 1), which is kd at normal incidence. k = 1 is lambert. With the light behind the viewer, a
    sphere of k = 1/2 is an even disc, as the full moon nearly is. Below k = 1 the power has a pole where a cosine is 0, so
    that cosines below 2^-20 count as 2^-20 in the power. In a picture n.v is at least 1e-3, so only n.l can be so small.
    """

    source: ClassVar[str] = "Minnaert 1941"
    breaks: ClassVar[dict[Law, str]] = {
        "energy": "with k below 1 the albedo kd (n.v)^(k - 1) grows without bound towards grazing angles"
    }
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["minnaert"] = "minnaert"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance: the albedo at normal incidence", base=True))
    k: Scalar = parameter(
        0.7, Parameter("limb darkening; 1: none, below 1: the outline is brighter", high=10.0, usual=(0.5, 2.0))
    )

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        return (Limit("k = 1 is lambert", cls(kd=kd, k=1.0), Lambert(kd=kd)),)

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        least = np.where(m.k < 1, GRAZING, np.finfo(l.dtype).tiny).astype(l.dtype)
        power = np.maximum(l[..., 2], least) ** (m.k - 1) * np.maximum(v[..., 2], least) ** (m.k - 1)
        return above_horizon(l, v, m.kd * ((m.k + 1) / (2 * math.pi) * power * l[..., 2])[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
