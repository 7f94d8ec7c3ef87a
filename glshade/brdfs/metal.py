"""metal: a rough conductor with exact Fresnel for each channel and no diffuse light."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Parameter, Scalar, Slot, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.optics.fresnel import f0_conductor, f_conductor, f_schlick
from glshade.optics.microfacet import ggx_cos
from glshade.textures.texture import Texture


class Metal(Brdf):
    """F(l.h) D(h) G2(l, v) / (4 n.v), where F is the Fresnel reflectance of the index eta + i k.

    D is GGX, and G2 is Smith's height-correlated shadowing. The model is reciprocal and reflects ambient light with its
    reflectance at normal incidence. Rough metals are darker than real ones, because light that is reflected several times
    between facets is lost. Where l = -v there is no half vector, and f cos is 0.
    """

    source: ClassVar[str] = "Walter et al. 2007, eqs. 20, 33; Heitz 2014, eq. 99; lecture slides 26, 34"
    isotropic_where: ClassVar[dict[str, str | float]] = {"anisotropy": 0.0}
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"roughness": 0.2},
        {"roughness": 0.4},
        {"roughness": 0.8},
        {"roughness": 0.5, "anisotropy": 0.9},
    )

    brdf: Literal["metal"] = "metal"
    # The defaults are those of evaporated gold: Olmon et al. 2012.
    eta: Colour = parameter(
        (0.1239, 0.3805, 1.541),
        Parameter("index of refraction; default: gold", low=0.01, high=100.0, usual=(0.1, 4.0), held=True),
    )
    k: Colour = parameter(
        (4.834, 2.196, 1.676), Parameter("extinction; default: gold", high=100.0, usual=(1.0, 8.0), held=True)
    )
    roughness: Scalar = parameter(
        0.3, Parameter("square root of alpha, the width of the lobe; below 0.01 it counts as 0.01", high=1.0, usual=(0.1, 1.0))
    )
    anisotropy: Scalar = parameter(
        0.0,
        Parameter(
            "stretches highlights along the tangent: alpha_x = alpha / s, alpha_y = alpha s, s = sqrt(1 - 0.9 anisotropy)",
            high=1.0,
        ),
    )
    fresnel: Literal["exact", "schlick"] = choice(
        "exact", "exact, or Schlick's approximation; its error is up to 0.255 within the usual ranges"
    )

    @property
    def needs_tangents(self) -> bool:
        return brushed(self.anisotropy)

    def slots(self) -> dict[str, Slot]:
        return {"ggx": ggx_slot(self.anisotropy), "fresnel": Slot((f"microfacet/fresnel_{self.fresnel}.glsl",))}

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
    """Returns the Fresnel reflectance (..., 3) at the cosine LoH (...). m: a material with eta, k and the option `fresnel`."""
    return f_conductor(m.eta, m.k, LoH) if m.fresnel == "exact" else f_schlick(f0_conductor(m.eta, m.k), LoH)


def cos_half(length2: Array) -> Array:
    """Returns l.h = |l + v| / 2 (...). length2 (...): |l + v|^2. A dot product would suffer from the rounding of |l| and |v|
    near l = -v."""
    result: Array = 0.5 * np.sqrt(length2)
    return result


def brushed(anisotropy: Any) -> bool:
    """Returns whether a material of this anisotropy depends on the tangent directions."""
    return isinstance(anisotropy, Texture) or anisotropy != 0


def ggx_slot(anisotropy: Any) -> Slot:
    """Returns the slot with the GLSL function ggx_cos, which reads tangents only if the material is anisotropic."""
    form = "anisotropic" if brushed(anisotropy) else "isotropic"
    return Slot((f"microfacet/ggx_{form}.glsl",))
