"""ggx: the metallic-roughness material of glTF."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.metal import Metal, brushed, cos_half, ggx_slot
from glshade.optics.fresnel import f_schlick, t_schlick
from glshade.optics.microfacet import ggx_cos


class Ggx(Brdf):
    """kd (1 - metallic)/pi (1 - F) n.l + F D(h) G2(l, v) / (4 n.v), F Schlick's of mix(f0, kd, metallic) at l.h.

    GGX with Smith's height-correlated shadowing. Reciprocal, because l.h is the same from both sides. Reflects ambient light
    with kd: the diffuse colour of a dielectric, what a metal reflects at normal incidence. Rough metals are darker than real
    ones, where light leaves after several reflections. Where l = -v there is no half vector, and no specular light. Many
    implementations take alpha^2 cos^2 - cos^2 + 1, wrong by 79 % at alpha 1e-3.
    """

    source: ClassVar[str] = "glTF 2.0, appendix B.3; Walter et al. 2007, eqs. 20, 33; Heitz 2014, eq. 99"
    breaks: ClassVar[dict[Law, str]] = {
        "energy": "the diffuse part makes way for what one facet reflects, not for the whole lobe: a white dielectric of "
        "roughness 0.1 gives back 1.7 times the light at grazing angles, of roughness 0.5 1.15 times; metallic = 1 keeps it"
    }
    isotropic_where: ClassVar[dict[str, str | float]] = {"anisotropy": 0.0}

    brdf: Literal["ggx"] = "ggx"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("base colour", high=1.0, base=True))
    f0: Colour = parameter((0.04, 0.04, 0.04), Parameter("a dielectric's reflectance at normal incidence", high=1.0))
    metallic: Scalar = parameter(0.0, Parameter("from dielectric (0) to metal (1)", high=1.0))
    roughness: Scalar = parameter(0.5, Parameter("square root of the width of the lobe, alpha", high=1.0, usual=(0.1, 1.0)))
    anisotropy: Scalar = parameter(0.0, Parameter("how much longer highlights are along the tangent", high=1.0))
    lobes: Literal["all", "specular"] = choice("all", "specular: without diffuse light")

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        # (n - 1)^2 + k^2 over (n + 1)^2 + k^2: numbers that float32 holds.
        f0, eta, k = (0.25, 0.5, 0.625), (3.0, 1.0, 3.0), (0.0, 2.0, 4.0)
        metal = Metal(eta=eta, k=k, roughness=0.4, anisotropy=0.5, fresnel="schlick")
        return (
            Limit("metallic = 1 is metal by Schlick", cls(kd=f0, metallic=1.0, roughness=0.4, anisotropy=0.5), metal),
            Limit("kd = 0 is metal by Schlick", cls(kd=0.0, f0=f0, roughness=0.4, anisotropy=0.5), metal),
        )

    @property
    def needs_tangents(self) -> bool:
        return brushed(self.anisotropy)

    def slots(self) -> dict[str, str]:
        dark = self.lobes == "specular" or self.metallic == 1 or self.kd == (0.0, 0.0, 0.0)
        diffuse = "none" if dark else "beside_schlick"
        return {"ggx": ggx_slot(self.anisotropy), "diffuse": f'#include "microfacet/diffuse_{diffuse}.glsl"\n'}

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
