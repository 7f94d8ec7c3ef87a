"""phong: ambient light, diffuse light and a specular lobe around the mirror direction."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import BRDFS, Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.textures.texture import Texture


class Phong(Brdf):
    """(kd n.l + ks max(r.v, 0)^exponent) / pi with r = 2 (n.l) n - l.

    It is empirical and not reciprocal, and it reflects ambient light with ka. Slides 18 and 24 do not check the sign of n.l, so
    that light from behind the surface could show where r.v > 0. Here f cos is 0 for such light.
    """

    source: ClassVar[str] = "Phong 1975; lecture slides 12, 17-24"
    breaks: ClassVar[dict[Law, str]] = {
        "reciprocity": "the lobe is not divided by n.l: the lecture's empirical model has f cos = ks (r.v)^p / pi",
        "energy": "the lobe reflects 2 ks/(p + 1) at normal incidence, which is more than ks where p is below 1",
    }
    shares: ClassVar[tuple[str, ...]] = ("kd", "ks")
    linear: ClassVar[tuple[str, ...]] = ("kd", "ks", "ka")

    brdf: Literal["phong"] = "phong"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("diffuse reflectance", base=True))
    ks: Colour = parameter((0.2, 0.2, 0.2), Parameter("specular strength at the lobe's centre"))
    exponent: Scalar = parameter(32.0, Parameter("narrowness of the lobe, p", high=1e8, usual=(1.0, 1000.0)))
    ka: Colour | None = parameter(None, Parameter("ambient reflectance; default: kd", same_as="kd"))

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        return (Limit("ks = 0 is lambert", cls(kd=kd, ks=(0.0, 0.0, 0.0)), Lambert(kd=kd)),)

    def canonical(self, ambient: bool) -> Brdf:
        return without_lobe(self, ambient)

    def half_angle(self) -> Brdf:
        return with_half_angle(self, "blinn_phong")

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        # In the local frame the mirror direction is l with x and y negated.
        r = l * np.array([-1.0, -1.0, 1.0])
        lobe = power_of_cosine(r, v, m.exponent)
        return above_horizon(l, v, (m.kd * l[..., 2:] + m.ks * lobe[..., None]) / math.pi)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.ka  # type: ignore[no-any-return]


def without_lobe(material: Any, ambient: bool) -> Brdf:
    """Returns a lambert if the material's ks is 0, and otherwise the material itself.

    ambient: whether ambient light reaches the material. If so, a ka that differs from kd keeps the material as it is.
    """
    ka = getattr(material, "ka", None)
    if material.ks == (0.0, 0.0, 0.0) and not (ambient and ka not in (None, material.kd)):
        surface = {name: getattr(material, name) for name in Brdf.model_fields if name != "brdf"}
        return Lambert.model_construct(brdf="lambert", kd=material.kd, **surface)
    return material  # type: ignore[no-any-return]


def with_half_angle(material: Any, model: str) -> Brdf:
    """Returns the material in the half-angle model.

    The angle between n and h is about half the angle between r and v, so the exponent becomes four times as large.
    """
    p = material.exponent
    if isinstance(p, Texture):
        fourfold = p.model_copy(update={key: tuple(4 * x for x in getattr(p, key)) for key in ("factor", "add")})
    else:
        fourfold = min(4 * p, 1e8)
    values = {name: getattr(material, name) for name in type(material).model_fields}
    return BRDFS[model].model_construct(**{**values, "brdf": model, "exponent": fourfold})


def power_of_cosine(a: Array, b: Array, p: Array) -> Array:
    """Returns max(a.b, 0)^p (...) for unit vectors a, b (..., 3). 0^0 is taken as 0, because a lobe ends at its horizon."""
    c = np.einsum("...i,...i->...", a, b)
    # For cosines near 1 the power would have an error of p * 1e-16 even in float64. 1 - a.b = |a - b|^2 / 2 keeps all digits.
    s = 0.5 * np.sum((a - b) ** 2, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_c = np.where(s < 0.5, np.log1p(-np.minimum(s, 0.5)), np.log(np.maximum(c, 1e-300)))
    return np.where(c > 0, np.exp(p * log_c), 0.0)
