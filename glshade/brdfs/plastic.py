"""plastic: a white highlight over a coloured diffuse base."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, Slot, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.metal import Metal
from glshade.brdfs.oren_nayar import as_lambert
from glshade.optics.fresnel import f_dielectric
from glshade.optics.interface import diffuse_fresnel, t_dielectric
from glshade.optics.microfacet import ggx_cos


class Plastic(Brdf):
    """(D V F(l.h) + kd/pi (1-F(n.l)) (1-F(n.v)) / (ior^2 (1 - kd F_inside))) n.l, where D and V are GGX.

    D is the distribution of facets, and V is their shadowing divided by 4 n.l n.v. Light that a smooth surface transmits is
    scattered by the base below it. The surface reflects the share F_inside of the scattered light back to the base, any number
    of times, and the rest leaves. From a white base all light leaves in the end. An ior of 1, which means no surface, gives
    lambert. The model is reciprocal and reflects ambient light with kd.
    """

    source: ClassVar[str] = "Walter et al. 2007, eqs. 20-34; Wolff 1994; Jakob 2010 (Mitsuba's plastic); Walsh 1926"
    breaks: ClassVar[Mapping[Law, str]] = {
        "energy": "the base gets the light that a smooth surface transmits, although a rough one reflects slightly more: up to "
        "1.0007 times the light leaves, and 1.0024 times with Schlick"
    }
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"roughness": 0.1},
        {"roughness": 0.3},
        {"roughness": 0.6},
        {"roughness": 1},
    )

    brdf: Literal["plastic"] = "plastic"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance of the base", high=1.0, base=True))
    ior: Scalar = parameter(1.5, Parameter("index of refraction", low=1.0, high=3.0, usual=(1.0, 2.5)))
    roughness: Scalar = parameter(
        0.2, Parameter("roughness of the surface, the square root of alpha; below 0.01 it counts as 0.01", high=1.0)
    )
    fresnel: Literal["exact", "schlick"] = choice(
        "exact", "exact: Fresnel's formulas; schlick: Schlick's approximation of all of them"
    )

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        black = cls(kd=0.0, ior=1.5, roughness=0.4)
        return (
            Limit("ior = 1 is lambert", cls(kd=kd, ior=1.0), Lambert(kd=kd)),
            Limit("a black base is a metal of k = 0", black, Metal(eta=1.5, k=0.0, roughness=0.4)),
        )

    def canonical(self, ambient: bool) -> Brdf:
        return as_lambert(self) if self.ior == 1.0 and self.fresnel == "exact" else self

    def slots(self) -> dict[str, Slot]:
        return {"interface": Slot((f"lobe/interface_{self.fresnel}.glsl",))}

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        NoL, NoV = np.maximum(l[..., 2], 0.0), np.maximum(v[..., 2], 0.0)
        LoH = np.minimum(0.5 * np.sqrt(length2), 1.0)
        ior = np.maximum(m.ior, 1.0)
        reflects, through, diffuse = interface(m.fresnel, ior, LoH, NoL, NoV)
        gloss = np.where(length2 > 1e-12, ggx_cos(l, v, h, m.roughness) * reflects, 0.0)
        base = under_interface(m.kd, ior, diffuse)
        return above_horizon(l, v, base * (through * NoL / math.pi)[..., None] + gloss[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


def interface(fresnel: str, ior: Array, LoH: Array, NoL: Array, NoV: Array) -> tuple[Array, Array, Array]:
    """Returns three values (...): the reflectance of a facet, the transmittance on the way in times that on the way out, and
    the share of diffuse light from outside that the surface reflects."""
    if fresnel == "exact":
        return f_dielectric(LoH, ior), t_dielectric(NoL, ior) * t_dielectric(NoV, ior), diffuse_fresnel(ior)
    f0 = ((ior - 1) / (ior + 1)) ** 2
    through = (1 - f0) ** 2 * (1 - (1 - NoL) ** 5) * (1 - (1 - NoV) ** 5)
    # The integral of 2 c (1 - c)^5 over [0, 1] is 1/21.
    return f0 + (1 - f0) * (1 - LoH) ** 5, through, f0 + (1 - f0) / 21


def under_interface(kd: Array, ior: Array, outside: Array) -> Array:
    """Returns kd / (ior^2 (1 - kd F_inside)) (..., 3): the base's colour after all reflections between base and surface.

    outside (...): F_outside, the share of diffuse light from outside that the surface reflects. Light paths are reversible, so
    ior^2 (1 - F_inside) = 1 - F_outside.
    """
    result: Array = kd / (ior[..., None] ** 2 * (1 - kd) + kd * (1 - outside[..., None]))
    return result
