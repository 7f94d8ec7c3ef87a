"""principled: Disney's principled model of 2012."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, Slot, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.burley import burley_diffuse

# The smallest width of a highlight in the published reference implementation (BRDF Explorer).
LEAST_ALPHA = 0.001


class Principled(Brdf):
    """The sum of Burley's diffuse lobe, a flat subsurface lobe, sheen, an anisotropic GGX highlight and a clear coat.

    It is the model as published in 2012. The highlight's shadowing is Smith's, separable and isotropic with the width (1/2 +
    roughness/2)^2. The coat's distribution falls off as 1/sin^2, its shadowing has the width 1/4, its strength is a quarter,
    and its F0 is 0.04. The revisions of 2014 and 2015 are different models. The base colour is kd, in linear light. The model
    is reciprocal and reflects ambient light with kd.
    """

    source: ClassVar[str] = "Burley 2012, section 5 and appendix B; the BRDF Explorer's disney.brdf of that year"
    breaks: ClassVar[Mapping[Law, str]] = {
        "energy": "each lobe was fitted alone; together they reflect up to 1.7 times the light at grazing angles (roughness 1, "
        "sheen and clear coat 1)"
    }
    isotropic_where: ClassVar[Mapping[str, str | float]] = {"anisotropy": 0.0}
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"roughness": 0.3},
        {"roughness": 0.8, "sheen": 1},
        {"metallic": 1, "roughness": 0.5, "anisotropy": 0.9},
        {"roughness": 0.7, "clearcoat": 1},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["principled"] = "principled"
    kd: Colour = parameter((0.8, 0.8, 0.8), Parameter("base colour", high=1.0, base=True))
    metallic: Scalar = parameter(0.0, Parameter("0: dielectric, 1: metal", high=1.0))
    subsurface: Scalar = parameter(0.0, Parameter("share of the flat subsurface lobe in the diffuse light", high=1.0))
    specular: Scalar = parameter(0.5, Parameter("strength of the highlight: F0 = 0.08 specular", high=1.0))
    roughness: Scalar = parameter(
        0.5, Parameter("roughness, the square root of alpha; the highlight's alpha is at least 0.001", high=1.0)
    )
    specular_tint: Scalar = parameter(0.0, Parameter("how far the highlight takes the hue of the base colour", high=1.0))
    anisotropy: Scalar = parameter(
        0.0,
        Parameter(
            "stretches the highlight along the tangent: alpha_x = alpha / s, alpha_y = alpha s, s = sqrt(1 - 0.9 anisotropy)",
            high=1.0,
        ),
    )
    sheen: Scalar = parameter(0.0, Parameter("extra light at grazing angles, as cloth has", high=1.0))
    sheen_tint: Scalar = parameter(0.5, Parameter("how far the sheen takes the hue of the base colour", high=1.0))
    clearcoat: Scalar = parameter(0.0, Parameter("strength of the clear coat's highlight", high=1.0))
    clearcoat_gloss: Scalar = parameter(1.0, Parameter("gloss of the clear coat; 0: satin, 1: glossy", high=1.0))
    lobes: Literal["all", "specular"] = choice("all", "all, or specular: without the diffuse lobes and sheen")

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        some: Any = {"kd": (0.8, 0.5, 0.2), "roughness": 0.4}
        return (
            Limit(
                "a metal ignores subsurface, sheen, specular and specular_tint",
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
        """Returns the names of the parts that the program has. A textured weight counts as neither 0 nor 1."""
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

    def slots(self) -> dict[str, Slot]:
        parts = self._parts()
        files: list[str] = [name for name in ("burley", "flat_subsurface") if name in parts]
        if parts & {"sheen_tint", "specular_tint"}:
            files.append("tint")
        files.append("gtr2_anisotropic" if self.needs_tangents else "gtr2_isotropic")
        if "clearcoat" in parts:
            files.append("clearcoat")
        functions = {"burley": "burley_diffuse", "flat_subsurface": "flat_subsurface"}
        diffuse = [f"{function}(m.roughness, NoL, NoV, LoH2)" for part, function in functions.items() if part in parts]
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
        if below:
            dimmed = "(1.0 - m.metallic) * " if "metal" in parts else ""
            lines.append(f"c += {dimmed}({' + '.join(below)});")
        arguments = "Principled m, Frame f, vec3 h, float NoL, float NoV, float LoH2, float fh, float facet"
        body = "".join(f"    {line}\n" for line in [*lines, "return c;"])
        text = f"\nvec3 principled_cos({arguments}) {{\n{body}}}\n"
        return {"lobes": Slot(tuple(f"lobe/{name}.glsl" for name in files), text)}

    def linear_colours(self) -> tuple[str, ...]:
        return () if self.mixes_channels else self.linear

    @property
    def mixes_channels(self) -> bool:
        # The hue of a tint is the base colour divided by its luminance.
        return bool(self._parts() & {"sheen_tint", "specular_tint"})

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
        diffuse = (1 - m.subsurface) * burley_diffuse(m.roughness, NoL, NoV, LoH**2) + m.subsurface * flat
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
    """Returns f cos (...) [1/sr] of the flat lobe with reflectance 1 (Hanrahan and Krueger 1993). LoH2 (...): (l.h)^2."""
    f90 = roughness * LoH2
    fss = (1 + (f90 - 1) * (1 - NoL) ** 5) * (1 + (f90 - 1) * (1 - NoV) ** 5)
    share = NoL / np.maximum(NoL + NoV, 1e-37)
    return 1.25 / math.pi * (fss * (share - NoL / 2) + NoL / 2)


def gtr2(h: Array, roughness: Array, anisotropy: Array) -> Array:
    """Returns the distribution (...) [1/sr] of the highlight's facets at half vectors h (..., 3) (Burley 2012, eqs. 8, 13)."""
    aspect = np.sqrt(1 - 0.9 * anisotropy)
    ax, ay = np.maximum(roughness**2 / aspect, LEAST_ALPHA), np.maximum(roughness**2 * aspect, LEAST_ALPHA)
    q = (h[..., 0] / ax) ** 2 + (h[..., 1] / ay) ** 2 + h[..., 2] ** 2
    with np.errstate(divide="ignore"):
        result: Array = 1 / (math.pi * ax * ay * q**2)
    return result


def gtr1(h: Array, a: Array) -> Array:
    """Returns the distribution (...) [1/sr] of the coat's facets at half vectors h (..., 3) (Burley 2012, B, eq. 4)."""
    q = a**2 * h[..., 2] ** 2 + h[..., 0] ** 2 + h[..., 1] ** 2
    with np.errstate(divide="ignore"):
        result: Array = (1 - a**2) / (-math.pi * np.log(a**2) * q)
    return result


def _shadowed(NoL: Array, NoV: Array, a: Any) -> Array:
    """Returns G / (4 n.l n.v) (...), where G is Smith's separable shadowing for GGX of width a (...) (Walter 2007, eq. 34)."""
    one, other = (1 / (c + np.sqrt(a**2 * (1 - c**2) + c**2)) for c in (NoL, NoV))
    result: Array = one * other
    return result
