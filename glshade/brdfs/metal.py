"""metal: a rough conductor, exact Fresnel for each channel, no diffuse light."""

from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Parameter, Scalar, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.optics.fresnel import f0_conductor, f_conductor, f_schlick
from glshade.optics.microfacet import ggx_cos
from glshade.textures.texture import Texture


class Metal(Brdf):
    """F(l.h) D(h) G2(l, v) / (4 n.v): GGX with Smith's height-correlated shadowing, and the Fresnel of the index eta + i k.

    Reciprocal. Reflects ambient light with what it reflects at normal incidence. Rough metals are darker than real ones, where
    light leaves after several reflections. Where l = -v there is no half vector, and no light.
    """

    source: ClassVar[str] = "Walter et al. 2007, eqs. 20, 33; Heitz 2014, eq. 99; lecture slides 26, 34"
    isotropic_where: ClassVar[dict[str, str | float]] = {"anisotropy": 0.0}

    brdf: Literal["metal"] = "metal"
    # Evaporated gold: Olmon et al. 2012.
    eta: Colour = parameter(
        (0.1239, 0.3805, 1.541), Parameter("index of refraction; left out: gold's", low=0.01, high=100.0, usual=(0.1, 4.0))
    )
    k: Colour = parameter((4.834, 2.196, 1.676), Parameter("extinction; left out: gold's", high=100.0, usual=(1.0, 8.0)))
    roughness: Scalar = parameter(0.3, Parameter("square root of the width of the lobe, alpha", high=1.0, usual=(0.1, 1.0)))
    anisotropy: Scalar = parameter(0.0, Parameter("how much longer highlights are along the tangent", high=1.0))
    fresnel: Literal["exact", "schlick"] = choice("exact", "Schlick's is off by up to 0.23 for metals")

    @property
    def needs_tangents(self) -> bool:
        return brushed(self.anisotropy)

    def slots(self) -> dict[str, str]:
        return {"ggx": ggx_slot(self.anisotropy), "fresnel": f'#include "microfacet/fresnel_{self.fresnel}.glsl"\n'}

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        return super().asked(by) - ({"anisotropy"} if not self.needs_tangents else set())

    def specular_part(self) -> Brdf:
        return self

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        lobe = np.where(length2 > 1e-12, ggx_cos(l, v, h, m.roughness, m.anisotropy), 0.0)
        return above_horizon(l, v, fresnel(m, cos_half(length2)) * lobe[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return f0_conductor(m.eta, m.k)


def fresnel(m: Any, LoH: Array) -> Array:
    """(..., 3): of a material with eta, k and the choice `fresnel`."""
    return f_conductor(m.eta, m.k, LoH) if m.fresnel == "exact" else f_schlick(f0_conductor(m.eta, m.k), LoH)


def cos_half(length2: Array) -> Array:
    """l.h = |l + v| / 2. As a dot product it would feel the rounding of |l| and |v| near l = -v."""
    result: Array = 0.5 * np.sqrt(length2)
    return result


def brushed(anisotropy: Any) -> bool:
    """Whether the material looks at the tangent directions."""
    return isinstance(anisotropy, Texture) or anisotropy != 0


def ggx_slot(anisotropy: Any) -> str:
    """GLSL's ggx_cos, with tangents only where they matter."""
    return f'#include "microfacet/ggx_{"anisotropic" if brushed(anisotropy) else "isotropic"}.glsl"\n'
