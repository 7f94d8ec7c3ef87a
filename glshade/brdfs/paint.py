"""paint: pigment and metal flakes under a clear coat."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Limit, Parameter, Scalar, Slot, above_horizon, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.ggx import Ggx
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.oren_nayar import as_lambert
from glshade.optics.fresnel import f_dielectric, f_schlick
from glshade.optics.interface import t_dielectric
from glshade.optics.microfacet import ggx_cos


class Paint(Brdf):
    """(((1-flakes) kd/pi + flakes D V F_schlick) T(n.l) T(n.v) + coat D V F(l.h)) n.l with T = 1 - coat F; D and V are GGX.

    D is the distribution of facets, and V is their shadowing divided by 4 n.l n.v. Metal flakes replace a share of the pigment.
    The coat dims the light of pigment and flakes on the way in and on the way out. It is modelled as thin: it does not bend
    light, and it does not reflect light back to the layer below, so that a coated paint is slightly too dark, never too bright.
    The model is reciprocal. It reflects ambient light with a mixture of kd and flake_colour, by the share of flakes.
    """

    source: ClassVar[str] = (
        "Walter et al. 2007, eqs. 20-34; Schlick 1994, eq. 15; Weidlich and Wilkie 2007; lecture slides 31-32"
    )
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"flakes": 0},
        {"flakes": 0.3, "coat_roughness": 0.3},
        {"flakes": 0.8, "flake_roughness": 0.5},
        {"flakes": 0.8, "coat": 0},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd", "flake_colour")

    brdf: Literal["paint"] = "paint"
    kd: Colour = parameter((0.5, 0.05, 0.05), Parameter("diffuse reflectance of the pigment", high=1.0, base=True))
    flake_colour: Colour = parameter((0.9, 0.9, 0.9), Parameter("reflectance of the flakes at normal incidence", high=1.0))
    flakes: Scalar = parameter(0.3, Parameter("share of flakes; the rest is pigment", high=1.0))
    flake_roughness: Scalar = parameter(
        0.5, Parameter("roughness of the layer of flakes, the square root of alpha; below 0.01 it counts as 0.01", high=1.0)
    )
    coat: Scalar = parameter(1.0, Parameter("share of the surface that has a coat", high=1.0))
    ior: Scalar = parameter(1.5, Parameter("index of refraction of the coat", low=1.0, high=3.0, usual=(1.0, 2.5)))
    coat_roughness: Scalar = parameter(
        0.1, Parameter("roughness of the coat, the square root of alpha; below 0.01 it counts as 0.01", high=1.0)
    )

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        return (
            Limit("no flakes and no coat is lambert", cls(kd=kd, flakes=0.0, coat=0.0), Lambert(kd=kd)),
            Limit("a coat of ior 1 over pigment is lambert", cls(kd=kd, flakes=0.0, ior=1.0), Lambert(kd=kd)),
            Limit(
                "flakes alone are ggx of a metal",
                cls(flake_colour=kd, flakes=1.0, flake_roughness=0.4, coat=0.0),
                Ggx(kd=kd, metallic=1.0, roughness=0.4),
            ),
            Limit("a coat of ior 1 equals no coat", cls(kd=kd, ior=1.0), cls(kd=kd, coat=0.0)),
        )

    def canonical(self, ambient: bool) -> Brdf:
        return as_lambert(self) if self._lobes() == ["pigment"] else self

    def _lobes(self) -> list[str]:
        """Returns the names of the lobes that the program has. A textured weight counts, since some texel may not be 0."""
        weights = {"pigment": self.flakes != 1.0, "flakes": self.flakes != 0.0, "coat": self.coat != 0.0 and self.ior != 1.0}
        return [name for name, weight in weights.items() if weight]

    def slots(self) -> dict[str, Slot]:
        lobes = self._lobes()
        terms = {"pigment": "pigment(m, NoL)", "flakes": "facet * flakes(m, f, l, v, h, LoH)"}
        value = " + ".join(terms[name] for name in lobes if name in terms)
        if "coat" in lobes:
            value = f"({value}) * coat_passes(m, NoL, NoV) + facet * coat_gloss(m, f, l, v, h, LoH)"
        arguments = "Paint m, Frame f, vec3 l, vec3 v, vec3 h, float NoL, float NoV, float LoH, float facet"
        files = tuple(f"lobe/{name}.glsl" for name in lobes)
        return {"lobes": Slot(files, f"\nvec3 paint_cos({arguments}) {{\n    return {value};\n}}\n")}

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        needs = {
            "pigment": {"kd"},
            "flakes": {"flakes", "flake_colour", "flake_roughness"},
            "coat": {"coat", "ior", "coat_roughness"},
        }
        lobes = self._lobes()
        return super().asked(by) - {name for lobe, names in needs.items() if lobe not in lobes for name in names}

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        NoL, NoV = np.maximum(l[..., 2], 0.0), np.maximum(v[..., 2], 0.0)
        LoH = np.minimum(0.5 * np.sqrt(length2), 1.0)
        facet = length2 > 1e-12
        ior = np.maximum(m.ior, 1.0)
        through = (1 - m.coat + m.coat * t_dielectric(NoL, ior)) * (1 - m.coat + m.coat * t_dielectric(NoV, ior))
        flakes = np.where(facet, m.flakes * ggx_cos(l, v, h, m.flake_roughness), 0.0)
        base = m.kd * ((1 - m.flakes) * NoL / math.pi)[..., None] + f_schlick(m.flake_colour, LoH) * flakes[..., None]
        gloss = np.where(facet, m.coat * f_dielectric(LoH, ior) * ggx_cos(l, v, h, m.coat_roughness), 0.0)
        return above_horizon(l, v, base * through[..., None] + gloss[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        flakes = m.flakes[..., None]
        return (1 - flakes) * m.kd + flakes * m.flake_colour  # type: ignore[no-any-return]
