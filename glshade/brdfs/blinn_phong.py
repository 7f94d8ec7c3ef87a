"""blinn_phong: the half-angle variant of phong."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.phong import power_of_cosine, without_lobe


class BlinnPhong(Brdf):
    """(kd n.l + ks max(n.h, 0)^exponent) / pi with h = (l + v)/|l + v|. Its lobe is wider than phong's at the same exponent.

    It reflects ambient light with ka. Where l = -v there is no half vector, and the specular part is 0.
    """

    source: ClassVar[str] = "Blinn 1977; lecture slide 20"
    breaks: ClassVar[dict[Law, str]] = {
        "reciprocity": "as in phong, the lobe is not divided by n.l",
        "energy": "the lobe reflects more than ks where p is below 5.4: 1.72 ks at p = 1, 2 ks at p = 0",
    }
    shares: ClassVar[tuple[str, ...]] = ("kd", "ks")
    linear: ClassVar[tuple[str, ...]] = ("kd", "ks", "ka")

    brdf: Literal["blinn_phong"] = "blinn_phong"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("diffuse reflectance", base=True))
    ks: Colour = parameter((0.2, 0.2, 0.2), Parameter("specular strength at the lobe's centre"))
    exponent: Scalar = parameter(128.0, Parameter("narrowness of the lobe, p", high=1e8, usual=(1.0, 1000.0)))
    ka: Colour | None = parameter(None, Parameter("ambient reflectance; default: kd", same_as="kd"))

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
        lobe = np.where(length2 > 1e-12, power_of_cosine(np.array([0.0, 0.0, 1.0]), h, m.exponent), 0.0)
        return above_horizon(l, v, (m.kd * l[..., 2:] + m.ks * lobe[..., None]) / math.pi)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.ka  # type: ignore[no-any-return]


def half_vector(l: Array, v: Array) -> tuple[Array, Array]:
    """Returns the unit half vectors h (..., 3), and |l + v|^2 (...).

    Where |l + v|^2 is below 1e-12, l = -v within float32 rounding, and h must not be used.
    """
    H = l + v
    length2 = np.sum(H * H, axis=-1)
    return H / np.sqrt(np.maximum(length2, 1e-12))[..., None], length2
