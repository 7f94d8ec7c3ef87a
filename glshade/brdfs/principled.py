"""principled: Disney's model of 2012."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.burley import burley

# The narrowest highlight that the published reference implementation (BRDF Explorer) draws.
LEAST_ALPHA = 0.001


class Principled(Brdf):
    """Burley's diffuse, flat subsurface, sheen, an anisotropic GGX highlight and a clear coat. Reciprocal.

    As published in 2012: the highlight's shadowing is Smith's, separable, isotropic and of width (1/2 + roughness/2)^2; the
    coat's distribution falls off as 1/sin^2, its shadowing is of width 1/4, its strength a quarter, its F0 0.04. Revisions of
    2014 and 2015 are other models. The base colour is kd, linear. Reflects ambient light with kd.
    """

    source: ClassVar[str] = "Burley 2012, section 5 and appendix B; the BRDF Explorer's disney.brdf of that year"
    breaks: ClassVar[Mapping[Law, str]] = {
        "energy": "lobes fitted one by one add up to as much as 1.7 of grazing light, at roughness 1 with sheen and coat"
    }
    isotropic_where: ClassVar[Mapping[str, str | float]] = {"anisotropy": 0.0}

    brdf: Literal["principled"] = "principled"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("base colour", high=1.0, base=True))
    metallic: Scalar = parameter(0.0, Parameter("0: dielectric, 1: metal", high=1.0))
    subsurface: Scalar = parameter(0.0, Parameter("how much of the diffuse has the flat shape of subsurface light", high=1.0))
    specular: Scalar = parameter(0.5, Parameter("strength of the highlight: F0 = 0.08 specular", high=1.0))
    roughness: Scalar = parameter(0.5, Parameter("roughness, the root of alpha", high=1.0))
    specular_tint: Scalar = parameter(0.0, Parameter("how much of the base colour's hue the highlight has", high=1.0))
    anisotropy: Scalar = parameter(0.0, Parameter("how much longer the highlight is along the tangent", high=1.0))
    sheen: Scalar = parameter(0.0, Parameter("light at grazing angles, for cloth", high=1.0))
    sheen_tint: Scalar = parameter(0.5, Parameter("how much of the base colour's hue the sheen has", high=1.0))
    clearcoat: Scalar = parameter(0.0, Parameter("strength of the second highlight", high=1.0))
    clearcoat_gloss: Scalar = parameter(1.0, Parameter("0: satin, 1: gloss", high=1.0))
    lobes: Literal["all", "specular"] = choice("all", "specular: without diffuse light and sheen")

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        some: Any = {"kd": (0.8, 0.5, 0.2), "roughness": 0.4}
        return (
            Limit(
                "a metal has no diffuse, no sheen and no specular of its own",
                cls(**some, metallic=1.0, subsurface=0.5, sheen=1.0, specular=1.0, specular_tint=1.0),
                cls(**some, metallic=1.0),
            ),
            Limit("anisotropy goes to 0", cls(**some, anisotropy=1e-30), cls(**some)),
            Limit(
                "all weights go to 0",
                cls(**some, metallic=1e-30, subsurface=1e-30, specular_tint=1e-30, sheen=1e-30, clearcoat=1e-30),
                cls(**some),
            ),
        )

    @property
    def needs_tangents(self) -> bool:
        return self.anisotropy != 0.0

    def _parts(self) -> set[str]:
        """What is in the program; a texture is never nothing, nor all."""
        base = self.metallic != 1.0
        below = base and self.lobes == "all"
        parts = {
            "burley": below and self.subsurface != 1.0,
            "flat_subsurface": below and self.subsurface != 0.0,
            "sheen": below and self.sheen != 0.0,
            "sheen_tint": below and self.sheen != 0.0 and self.sheen_tint != 0.0,
            "specular": base,
            "specular_tint": base and self.specular != 0.0 and self.specular_tint != 0.0,
            "metal": self.metallic != 0.0,
            "clearcoat": self.clearcoat != 0.0,
        }
        return {name for name, there in parts.items() if there}

    def slots(self) -> dict[str, str]:
        parts = self._parts()
        files: list[str] = [name for name in ("burley", "flat_subsurface") if name in parts]
        files += ["tint"] * bool(parts & {"sheen_tint", "specular_tint"})
        files += ["gtr2_anisotropic" if self.needs_tangents else "gtr2_isotropic"] + ["clearcoat"] * ("clearcoat" in parts)
        diffuse = [f"{name}(m.roughness, NoL, NoV, LoH2)" for name in ("burley", "flat_subsurface") if name in parts]
        below = []
        if diffuse:
            below = [f"m.kd * {diffuse[0] if len(diffuse) == 1 else f'mix({diffuse[0]}, {diffuse[1]}, m.subsurface)'}"]
        if "sheen" in parts:
            below.append(f"{_tinted('m.sheen * fh * NoL', 'sheen_tint' in parts, 'm.sheen_tint')}")
        f0 = _tinted("0.08 * m.specular", "specular_tint" in parts, "m.specular_tint")
        if "metal" in parts:
            f0 = f"mix({f0}, m.kd, m.metallic)" if "specular" in parts else "m.kd"
        lines = [
            f"vec3 f0 = {f0};",
            "vec3 c = (f0 + (1.0 - f0) * fh) * (facet * gtr2_cos(f, h, NoL, NoV, m.roughness, m.anisotropy));",
        ]
        if "clearcoat" in parts:
            lines.append("c += facet * clearcoat(f, h, NoL, NoV, fh, m.clearcoat, m.clearcoat_gloss);")
        dimmed = "(1.0 - m.metallic) * " * ("metal" in parts)
        lines += [f"c += {dimmed}({' + '.join(below)});"] * bool(below)
        arguments = "Principled m, Frame f, vec3 h, float NoL, float NoV, float LoH2, float fh, float facet"
        text = "".join(f'#include "lobe/{name}.glsl"\n' for name in files) + f"\nvec3 principled_cos({arguments}) {{\n"
        return {"lobes": text + "".join(f"    {line}\n" for line in [*lines, "return c;"]) + "}\n"}

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        parts = self._parts()
        kept = {
            "kd": by == "ambient" or bool(parts & {"burley", "flat_subsurface", "specular_tint", "metal"}),
            "metallic": parts >= {"metal", "specular"},
            "subsurface": parts >= {"burley", "flat_subsurface"},
            "specular": "specular" in parts,
            "specular_tint": "specular_tint" in parts,
            "anisotropy": self.needs_tangents,
            "sheen": "sheen" in parts,
            "sheen_tint": "sheen_tint" in parts,
            "clearcoat": "clearcoat" in parts,
            "clearcoat_gloss": "clearcoat" in parts,
        }
        return super().asked(by) - {name for name, keep in kept.items() if not keep}

    def specular_part(self) -> Brdf:
        return self.model_copy(update={"lobes": "specular"})

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        NoL, NoV = np.maximum(l[..., 2], 0.0), np.maximum(v[..., 2], 0.0)
        LoH = np.minimum(0.5 * np.sqrt(length2), 1.0)
        fh, facet = (1 - LoH) ** 5, length2 > 1e-12
        luminance = 0.3 * m.kd[..., :1] + 0.6 * m.kd[..., 1:2] + 0.1 * m.kd[..., 2:]
        hue = np.where(luminance > 0, m.kd / np.where(luminance > 0, luminance, 1.0), 1.0)
        metallic = m.metallic[..., None]

        flat = flat_subsurface(m.roughness, NoL, NoV, LoH**2)
        diffuse = (1 - m.subsurface) * burley(m.roughness, NoL, NoV, LoH**2) + m.subsurface * flat
        sheen = (m.sheen * fh * NoL)[..., None] * _mix(1.0, hue, m.sheen_tint[..., None])
        f0 = 0.08 * m.specular[..., None] * _mix(1.0, hue, m.specular_tint[..., None])
        f0 = _mix(f0, m.kd, metallic)
        highlight = np.where(facet, gtr2(h, m.roughness, m.anisotropy), 0.0) * NoL
        highlight = highlight * _shadowed(NoL, NoV, (0.5 + m.roughness / 2) ** 2)
        coat = np.where(facet, gtr1(h, _mix(0.1, 0.001, m.clearcoat_gloss)), 0.0) * NoL
        coat = 0.25 * m.clearcoat * coat * _shadowed(NoL, NoV, 0.25) * _mix(0.04, 1.0, fh)
        value = _mix(f0, 1.0, fh[..., None]) * highlight[..., None] + coat[..., None]
        if m.lobes == "all":
            value = value + (1 - metallic) * (m.kd * diffuse[..., None] + sheen)
        return above_horizon(l, v, value)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


def _tinted(strength: str, tinted: bool, tint: str) -> str:
    return f"({strength}) * mix(vec3(1.0), tint(m.kd), {tint})" if tinted else f"vec3({strength})"


def _mix(a: Any, b: Any, t: Any) -> Any:
    return a * (1 - t) + b * t


def flat_subsurface(roughness: Array, NoL: Array, NoV: Array, LoH2: Array) -> Array:
    """f cos (...) of reflectance 1, after Hanrahan and Krueger 1993; LoH2 = (l.h)^2."""
    f90 = roughness * LoH2
    fss = (1 + (f90 - 1) * (1 - NoL) ** 5) * (1 + (f90 - 1) * (1 - NoV) ** 5)
    share = NoL / np.maximum(NoL + NoV, 1e-37)
    return 1.25 / math.pi * (fss * (share - NoL / 2) + NoL / 2)


def gtr2(h: Array, roughness: Array, anisotropy: Array) -> Array:
    """The distribution of the highlight's facets (...), [1/sr]; h (..., 3). Burley 2012, eqs. 8 and 13."""
    aspect = np.sqrt(1 - 0.9 * anisotropy)
    ax, ay = np.maximum(roughness**2 / aspect, LEAST_ALPHA), np.maximum(roughness**2 * aspect, LEAST_ALPHA)
    q = (h[..., 0] / ax) ** 2 + (h[..., 1] / ay) ** 2 + h[..., 2] ** 2
    with np.errstate(divide="ignore"):
        result: Array = 1 / (math.pi * ax * ay * q**2)
    return result


def gtr1(h: Array, a: Array) -> Array:
    """The distribution of the coat's facets (...), [1/sr]; h (..., 3). Burley 2012, eq. 4 of appendix B."""
    q = a**2 * h[..., 2] ** 2 + h[..., 0] ** 2 + h[..., 1] ** 2
    with np.errstate(divide="ignore"):
        result: Array = (1 - a**2) / (-math.pi * np.log(a**2) * q)
    return result


def _shadowed(NoL: Array, NoV: Array, a: Any) -> Array:
    """G / (4 n.l n.v) of Smith's separable shadowing for GGX of width a (...). Walter et al. 2007, eq. 34."""
    one, other = (1 / (c + np.sqrt(a**2 * (1 - c**2) + c**2)) for c in (NoL, NoV))
    result: Array = one * other
    return result
