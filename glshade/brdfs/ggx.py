"""ggx: the metallic-roughness material of glTF."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, Slot, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.metal import Metal, brushed, cos_half, ggx_slot
from glshade.optics.fresnel import f_schlick, t_schlick
from glshade.optics.microfacet import ggx_cos


class Ggx(Brdf):
    """kd (1 - metallic)/pi (1 - F) n.l + F D(h) G2(l, v) / (4 n.v), where F is Schlick's for mix(f0, kd, metallic) at l.h.

    D is GGX, and G2 is Smith's height-correlated shadowing. The model is reciprocal, because l.h = v.h. It reflects ambient
    light with kd, which is the diffuse colour of a dielectric and the reflectance of a metal at normal incidence. Rough metals
    are darker than real ones, because light that is reflected several times between facets is lost. Where l = -v there is no
    half vector, and the specular part is 0. Many implementations compute D by alpha^2 cos^2 - cos^2 + 1, which in float32 is
    wrong by 79 % at alpha 1e-3.
    """

    source: ClassVar[str] = "glTF 2.0, appendix B.3; Walter et al. 2007, eqs. 20, 33; Heitz 2014, eq. 99"
    breaks: ClassVar[dict[Law, str]] = {
        "energy": "the diffuse part shrinks by the reflectance of one facet, not by that of the whole lobe: at grazing angles "
        "a white dielectric reflects 1.7 times the light at roughness 0.1 and 1.15 times at roughness 0.5; metals keep the law"
    }
    isotropic_where: ClassVar[dict[str, str | float]] = {"anisotropy": 0.0}
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"metallic": 0, "roughness": 0.3},
        {"metallic": 0, "roughness": 0.7},
        {"metallic": 1, "roughness": 0.3},
        {"metallic": 1, "roughness": 0.5, "anisotropy": 0.9},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["ggx"] = "ggx"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("base colour", high=1.0, base=True))
    f0: Colour = parameter((0.04, 0.04, 0.04), Parameter("a dielectric's reflectance at normal incidence", high=1.0))
    metallic: Scalar = parameter(0.0, Parameter("0: dielectric, 1: metal", high=1.0))
    roughness: Scalar = parameter(
        0.5, Parameter("square root of alpha, the width of the lobe; below 0.01 it counts as 0.01", high=1.0, usual=(0.1, 1.0))
    )
    anisotropy: Scalar = parameter(
        0.0,
        Parameter(
            "stretches highlights along the tangent: alpha_x = alpha / s, alpha_y = alpha s, s = sqrt(1 - 0.9 anisotropy)",
            high=1.0,
        ),
    )
    lobes: Literal["all", "specular"] = choice("all", "all, or specular: without the diffuse lobe")

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        # f0 = ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2). All these numbers are exact in float32.
        f0, eta, k = (0.25, 0.5, 0.625), (3.0, 1.0, 3.0), (0.0, 2.0, 4.0)
        metal = Metal(eta=eta, k=k, roughness=0.4, anisotropy=0.5, fresnel="schlick")
        return (
            Limit("metallic = 1 is metal by Schlick", cls(kd=f0, metallic=1.0, roughness=0.4, anisotropy=0.5), metal),
            Limit("kd = 0 is metal by Schlick", cls(kd=0.0, f0=f0, roughness=0.4, anisotropy=0.5), metal),
        )

    @property
    def needs_tangents(self) -> bool:
        return brushed(self.anisotropy)

    def slots(self) -> dict[str, Slot]:
        dark = self.lobes == "specular" or self.metallic == 1 or self.kd == (0.0, 0.0, 0.0)
        diffuse = "none" if dark else "beside_schlick"
        return {"ggx": ggx_slot(self.anisotropy), "diffuse": Slot((f"microfacet/diffuse_{diffuse}.glsl",))}

    def linear_colours(self) -> tuple[str, ...]:
        # Between a dielectric and a metal, kd is part of the Fresnel term that dims the diffuse lobe of kd.
        return self.linear if self.metallic in (0.0, 1.0) or self.lobes == "specular" else ()

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        return super().asked(by) - ({"anisotropy"} if not self.needs_tangents else set())

    def specular_part(self) -> Brdf:
        return self.model_copy(update={"lobes": "specular"})

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        LoH = cos_half(length2)
        metallic = np.asarray(m.metallic)[..., None]
        f0 = m.f0 * (1 - metallic) + m.kd * metallic
        lobe = np.where(length2 > 1e-12, ggx_cos(l, v, h, m.roughness, m.anisotropy), 0.0)
        value = f_schlick(f0, LoH) * lobe[..., None]
        if m.lobes == "all":
            value = value + m.kd * (1 - metallic) / math.pi * t_schlick(1 - f0, LoH) * l[..., 2:]
        return above_horizon(l, v, value)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]
