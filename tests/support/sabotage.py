"""Sabotages: small changes of the GLSL, each with a scene that shows it, to test how much the verifier sees.

A sabotage replaces a piece of a program's text, as `glshade glsl` prints it: all shader files are in place, and unused code is
left out. The mutations of `glshade verify --mutate` are large faults that show in almost every scene. Sabotages are as small as
slips of a programmer can be, down to a constant that is wrong by 0.05 %.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade import Mesh, Renderer, Scene
from glshade.gl.preparation import ApproximateWarning
from glshade.glsl.source import Rewrite, Source, Stage
from glshade.verification.candidates import Candidates, find_candidates
from glshade.verification.verdict import verdict_of

ASSETS = Path(__file__).resolve().parents[2] / "scenes" / "assets"
# A sabotage that the verifier does not find must change no value of the picture by more than this [linear].
UNSEEN = 5e-6
SIZE = (160, 120)


@dataclass(frozen=True)
class Sabotage:
    """A change of the GLSL.

    name: what is wrong, in words.
    scene: the name of the scene in SCENES that shows it.
    old: the text that is replaced, wherever it stands in the scene's programs.
    new: the text that takes its place.
    found: whether the verifier finds it. If it does not, the picture changes by UNSEEN at most.
    """

    name: str
    scene: str
    old: str
    new: str
    found: bool = True


@dataclass(frozen=True)
class Outcome:
    """The result of one sabotage.

    verdict: the verifier's verdict on the picture that the sabotaged programs draw.
    change: the largest difference that the sabotage makes to any value of the picture [linear].
    """

    verdict: str
    change: float


class Saboteur:
    """Draws the scenes with sabotaged programs. It keeps the picture and the candidates of each scene."""

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        self._clean: dict[str, tuple[NDArray[Any], Candidates]] = {}

    def clean(self, name: str) -> tuple[NDArray[Any], Candidates]:
        """Returns (picture, candidates) of a scene without a sabotage."""
        if name not in self._clean:
            self._clean[name] = self._drawn(SCENES[name]), find_candidates(SCENES[name])
        return self._clean[name]

    def verdict(self, name: str) -> str:
        """Returns the verifier's verdict on a scene without a sabotage."""
        return verdict_of(*self.clean(name), explain=False).verdict

    def outcome(self, sabotage: Sabotage) -> Outcome:
        """Returns the result of a sabotage. Errors: ValueError if the text that it replaces is in none of the programs."""
        clean, candidates = self.clean(sabotage.scene)
        edited = _Edit(sabotage.old, sabotage.new)
        picture = self._drawn(SCENES[sabotage.scene], edited)
        if not edited.found:
            raise ValueError(f"{sabotage.name}: no program of the scene {sabotage.scene!r} contains {sabotage.old!r}")
        change = float(np.abs(picture.astype(np.float64) - clean).max())
        return Outcome(verdict_of(picture, candidates, explain=False).verdict, change)

    def faults(self, sabotages: Iterable[Sabotage]) -> list[str]:
        """Returns a line for each sabotage whose outcome is not the one that the table promises."""
        lines = []
        for sabotage in sabotages:
            outcome = self.outcome(sabotage)
            kept = outcome.verdict == "failed" if sabotage.found else outcome.change <= UNSEEN
            if not kept:
                lines.append(f"{sabotage.name} ({sabotage.scene}): {outcome.verdict}, changes {outcome.change:.1e}")
        return lines

    def _drawn(self, scene: Scene, rewrite: Rewrite | None = None) -> NDArray[Any]:
        """Returns a copy of the picture (H, W, 3 or 4) that rewritten programs draw."""
        self.renderer.rewrite = rewrite
        try:
            with warnings.catch_warnings():
                # The reference composites the only blended surface of the table exactly.
                warnings.simplefilter("ignore", ApproximateWarning)
                # The renderer reuses the array for its next picture, so this one is copied.
                return self.renderer.render(scene, dtype="float32").pixels.copy()
        finally:
            self.renderer.rewrite = None


class _Edit:
    """A Rewrite that replaces a text, and remembers in `found` whether a program had the text."""

    def __init__(self, old: str, new: str) -> None:
        self.old, self.new, self.found = old, new, False

    def __call__(self, source: Source) -> Source:
        fragment = self._edited(source.fragment) if source.fragment else None
        return replace(source, vertex=self._edited(source.vertex), fragment=fragment)

    def _edited(self, stage: Stage) -> Stage:
        self.found |= self.old in stage.text
        return replace(stage, text=stage.text.replace(self.old, self.new))


SUN: dict[str, Any] = {"type": "directional", "direction": (-0.5, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)}
# This lamp stands behind the ball and shines along the ball's outline, where many terms of the models are large.
LAMP: dict[str, Any] = {"type": "point", "position": (2.0, 1.0, -1.5), "intensity": 3.0, "colour": (0.6, 0.8, 1.0)}
# A lamp beside the viewer shows retro-reflection and sheen.
HEADLAMP: dict[str, Any] = {"type": "directional", "direction": (-0.1, -0.3, -1.0), "intensity": 0.5}
LIGHTS = (SUN, LAMP, HEADLAMP)
CAMERA: dict[str, Any] = {"eye": (0.4, 0.6, 3.4), "target": (0.0, 0.0, 0.0), "fov": 38}
LAMBERT: dict[str, Any] = {"brdf": "lambert", "kd": (0.8, 0.6, 0.4)}
GLOSSY: dict[str, Any] = {"brdf": "phong", "kd": (0.5, 0.4, 0.3), "ks": 0.4, "exponent": 60.0, "ka": 0.2}
METAL: dict[str, Any] = {"brdf": "metal", "roughness": 0.5}


def scene(objects: Any, lights: Any = LIGHTS, camera: Any = CAMERA, **more: Any) -> Scene:
    """Returns a scene of one object or several. more: further keys of the scene file."""
    objects = [objects] if isinstance(objects, dict) else objects
    film = {"size": SIZE, **more.pop("film", {})}
    return Scene.model_validate({"objects": objects, "lights": lights, "camera": camera, "film": film, **more})


def ball(material: Any, lights: Any = LIGHTS, rate: str = "phong", **more: Any) -> Scene:
    """Returns a scene of a ball that almost fills the picture. more: further keys of the scene file."""
    shape = {"type": "sphere", "segments": 48, "rings": 24}
    return scene({"shape": shape, "material": material, "shading": rate}, lights, **more)


def of_model(name: str, **parameters: Any) -> Scene:
    """Returns a scene of a ball of one model. parameters: those that differ from the model's defaults."""
    return ball({"brdf": name, **parameters})


def textured(name: str, **maps: Any) -> Scene:
    """Returns a scene of a small piece of a textured floor, on which a texel is larger than a pixel.

    name: the model. maps: its parameters and maps.
    """
    floor = {"shape": "plane", "material": {"brdf": name, **maps}}
    camera = {"type": "orthographic", "eye": (0.3, 1.0, 0.4), "target": (0.3, 0.0, 0.1), "height": 0.1}
    near = {"type": "point", "position": (0.1, 0.4, -0.2), "intensity": 0.3}
    return scene(floor, (near, HEADLAMP | {"direction": (0.2, -1.0, 0.1)}), camera)


def square(colours: Any, **keys: Any) -> dict[str, Any]:
    """Returns a square that reaches over the picture's border, with a colour [linear] and an alpha in each corner (4, 4)."""
    corners = np.array([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], dtype=np.float64)
    mesh = Mesh.build(corners, np.array([(0, 1, 2), (0, 2, 3)]), colours=np.array(colours, dtype=np.float64))
    return {"mesh": mesh, "sides": "both", **keys}


CORNERS = ((0.9, 0.2, 0.1, 0.1), (0.3, 0.8, 0.2, 0.4), (0.2, 0.4, 0.9, 0.9), (0.7, 0.7, 0.3, 0.6))
UNEVEN = {"scale": (1.0, 0.6, 0.8), "rotate": (20.0, 30.0, 10.0)}
STRETCHED = {"shape": {"type": "sphere", "segments": 48, "rings": 24}, "material": LAMBERT, "transform": UNEVEN}
MANY = tuple({**LAMP, "position": (-2 + i % 10 / 2, 2 - i // 10 / 2, 2.5), "intensity": 0.1} for i in range(70))
SPOT = {"position": (0.5, 1.5, 3.0), "direction": (-0.4, -1.3, -3.0), "inner": 6.0, "outer": 14.0, "intensity": 2.0}
PANE = {"shape": "plane", "sides": "both", "material": LAMBERT, "transform": {"rotate": (60.0, 0.0, 0.0)}}
FROM_BELOW = {"eye": (0.3, -2.5, 0.5), "target": (0.0, 0.0, 0.0), "fov": 30}

SCENES: dict[str, Scene] = {
    # The models.
    "ambient": scene(square(CORNERS, material={"brdf": "ambient"}), ({"type": "ambient", "intensity": 0.8},)),
    "ashikhmin_shirley": of_model("ashikhmin_shirley", pu=20.0, pv=200.0, ks=0.3),
    "beckmann": of_model("beckmann", roughness=0.6),
    "beckmann v_groove": of_model("beckmann", roughness=0.6, geometry="v_groove", fresnel="schlick"),
    "blinn_phong": of_model("blinn_phong", ks=0.4, exponent=60.0),
    "blinn_phong_normalised": of_model("blinn_phong_normalised", ks=0.4, exponent=20.0),
    "burley": of_model("burley", roughness=0.8),
    "ggx": of_model("ggx", roughness=0.4, metallic=0.4),
    "ggx anisotropic": of_model("ggx", roughness=0.5, anisotropy=0.8),
    "lafortune": of_model("lafortune"),
    "lambert": ball(LAMBERT),
    "measured": of_model("measured"),
    "metal": ball(METAL),
    "metal schlick": ball({**METAL, "fresnel": "schlick"}),
    "minnaert": of_model("minnaert", k=1.4),
    "oren_nayar": of_model("oren_nayar", sigma=0.6),
    "oren_nayar_qualitative": of_model("oren_nayar_qualitative", sigma=0.6),
    "paint": of_model("paint", flakes=0.4, coat=0.8),
    "phong": ball(GLOSSY),
    "phong_normalised": of_model("phong_normalised", ks=0.4, exponent=20.0),
    "plastic": of_model("plastic"),
    "plastic schlick": of_model("plastic", fresnel="schlick"),
    "principled": of_model(
        "principled",
        kd=(0.6, 0.3, 0.1),
        subsurface=0.5,
        specular_tint=0.5,
        sheen=0.5,
        sheen_tint=0.5,
        clearcoat=0.8,
        clearcoat_gloss=0.5,
    ),
    "principled anisotropic": of_model("principled", anisotropy=0.7, metallic=0.5),
    "retro_ggx": of_model("retro_ggx", roughness=0.4),
    "retro_phong": of_model("retro_phong"),
    "strauss": of_model("strauss", smoothness=0.6, metalness=0.5),
    "ward": of_model("ward", alpha_x=0.2, alpha_y=0.3),
    "ward isotropic": of_model("ward", alpha_x=0.2, alpha_y=0.2),
    "ward_duer": of_model("ward_duer", alpha_x=0.2, alpha_y=0.3),
    "ward_gmd": of_model("ward_gmd", alpha_x=0.2, alpha_y=0.3),
    # The lights.
    "directional": ball(LAMBERT, (SUN,)),
    "point": ball(LAMBERT, (LAMP | {"falloff": "none"},)),
    "point 1/r": ball(LAMBERT, (LAMP | {"falloff": "1/r"},)),
    "point 1/r^2": ball(LAMBERT, (LAMP | {"r_min": 0.1},)),
    "point r_min": ball(LAMBERT, (LAMP | {"r_min": 3.0},)),
    "70 points": ball(LAMBERT, MANY),
    "spot": ball(LAMBERT, ({**SPOT, "type": "spot"},)),
    "gltf_spot": ball(LAMBERT, ({**SPOT, "type": "gltf_spot"},)),
    # Geometry, cameras and rates.
    "stretched": scene(STRETCHED),
    "orthographic": ball(GLOSSY, camera={"type": "orthographic", "eye": (0.4, 0.6, 3.4), "target": (0.0, 0.0, 0.0)}),
    "coarse": scene({"shape": {"type": "sphere", "segments": 8, "rings": 4}, "normals": "smooth", "material": GLOSSY}),
    "gouraud": ball(GLOSSY, rate="gouraud"),
    "flat": ball(GLOSSY, rate="flat"),
    "both sides": scene(PANE, camera=FROM_BELOW),
    "both sides gouraud": scene(PANE | {"shading": "gouraud"}, camera=FROM_BELOW),
    "both sides flat": scene(PANE | {"shading": "flat"}, camera=FROM_BELOW),
    "crossing": scene([PANE, PANE | {"material": GLOSSY, "transform": {"rotate": (-30.0, 20.0, 0.0)}}]),
    # Textures, colours and alpha.
    "colour texture": textured("lambert", kd={"texture": ASSETS / "tiles-colour.png"}),
    "normal map": textured("lambert", normal_map={"texture": ASSETS / "tiles-normal.png"}),
    "bump map": textured("lambert", bump_map={"texture": ASSETS / "hammered-height.png", "height": 0.05}),
    "mirrored normal map": scene(
        {
            "shape": "sphere",
            "material": {**LAMBERT, "normal_map": {"texture": ASSETS / "chipped-surface.png"}},
            "transform": {"scale": (-1.0, 1.0, 1.0)},
        }
    ),
    "channel": textured("ggx", metallic=0.5, roughness={"texture": ASSETS / "chipped-surface.png", "channel": "g"}),
    "direction map": textured("ward", alpha_x=0.1, alpha_y=0.3, tangent_direction={"texture": ASSETS / "turned-direction.png"}),
    "turned": of_model("ward", alpha_x=0.1, alpha_y=0.3, tangent_direction=30.0),
    "vertex colours": scene(square(CORNERS, material=LAMBERT)),
    "mask": scene(square(CORNERS, material={**LAMBERT, "alpha_mode": "mask", "alpha_cutoff": 0.5})),
    "blend": scene(square(CORNERS, material={**LAMBERT, "alpha_mode": "blend"}), film={"background": (0.1, 0.2, 0.4)}),
    "exposed": ball(LAMBERT, film={"exposure": 3.0}),
}

SABOTAGES: tuple[Sabotage, ...] = (
    # The models. Constants and exponents are wrong by 0.05 % where nothing else is named.
    Sabotage("ambient: reflectance", "ambient", "return m.ka;", "return m.ka * 1.0005;"),
    Sabotage("ashikhmin_shirley: norm", "ashikhmin_shirley", "0.125 * INV_PI", "0.1250625 * INV_PI"),
    Sabotage("ashikhmin_shirley: 28/23", "ashikhmin_shirley", "28.0 / 23.0", "28.014 / 23.0"),
    Sabotage(
        "ashikhmin_shirley: exponents exchanged", "ashikhmin_shirley", "m.pu * Hu2 + m.pv * Hv2", "m.pv * Hu2 + m.pu * Hv2"
    ),
    Sabotage("ashikhmin_shirley: only n.l in the divisor", "ashikhmin_shirley", "max(NoL, NoV)", "NoL"),
    Sabotage("ashikhmin_shirley: no Fresnel term", "ashikhmin_shirley", "f_schlick(m.ks, LoH)", "m.ks"),
    Sabotage("ashikhmin_shirley: series of the logarithm", "ashikhmin_shirley", "-2.0 / (2.0 - s)", "-2.001 / (2.0 - s)"),
    Sabotage(
        "beckmann: D divided by the cosine to the power 2", "beckmann", "alpha * alpha * cos2 * cos2", "alpha * alpha * cos2"
    ),
    Sabotage("beckmann: D's exponent", "beckmann", "float x = s * (2.0 - s)", "float x = 1.0005 * s * (2.0 - s)"),
    Sabotage("beckmann: l and v exchanged in G", "beckmann", "NoL * Lv + NoV * Ll", "NoL * Ll + NoV * Lv"),
    Sabotage("beckmann: error function in G", "beckmann", "0.564189584", "0.564471679"),
    Sabotage("beckmann: p-polarised part of F", "beckmann", "1.0 + (less * less + bc2)", "1.0 + 1.005 * (less * less + bc2)"),
    Sabotage("beckmann: light is transmitted once only", "beckmann", "* t_conductor(eta, k, NoV)", ""),
    Sabotage("v_groove: no masking by n.l", "beckmann v_groove", "min(NoL / NoV, 1.0)", "1.0"),
    Sabotage("v_groove: factor", "beckmann v_groove", "4.0 * NoH", "4.002 * NoH"),
    Sabotage("blinn_phong: exponent", "blinn_phong", "m.exponent) : 0.0", "m.exponent * 1.0005) : 0.0"),
    Sabotage("blinn_phong_normalised: norm", "blinn_phong_normalised", "(p + 4.0)", "(p + 4.01)"),
    Sabotage("burley: exponent 4 in place of 5", "burley", "a2 * a2 * a", "a2 * a2"),
    Sabotage("burley: F90", "burley", "2.0 * roughness * LoH2 - 0.5", "2.001 * roughness * LoH2 - 0.5"),
    Sabotage("ggx: D", "ggx", "0.5 * INV_PI * a2", "0.50025 * INV_PI * a2"),
    Sabotage("ggx: D's divisor is not squared", "ggx", "a2 / (q * q)", "a2 / q"),
    Sabotage("ggx: G without the viewer", "ggx", "NoL * gv + NoV * gl", "NoL + NoV * gl"),
    Sabotage("ggx: roughness is not squared", "ggx", "return roughness * roughness;", "return roughness;"),
    Sabotage("ggx: exponent 4 in Schlick's F", "ggx", "x2 * x2 * x", "x2 * x2"),
    Sabotage("ggx: F0 of the metallic part", "ggx", "mix(m.f0, m.kd, m.metallic)", "mix(m.f0, m.kd * 1.0005, m.metallic)"),
    Sabotage("ggx: anisotropy", "ggx anisotropic", "1.0 - 0.9 * anisotropy", "1.0 - 0.8995 * anisotropy"),
    Sabotage(
        "ggx: tangents exchanged", "ggx anisotropic", "dot(f.t, d) / ax, dot(f.b, d) / ay", "dot(f.b, d) / ax, dot(f.t, d) / ay"
    ),
    Sabotage("lafortune: exponent", "lafortune", "exp(0.5 * p * log_base)", "exp(0.50025 * p * log_base)"),
    Sabotage("lafortune: norm", "lafortune", "(0.5 * p + 1.0)", "(0.5 * p + 1.01)"),
    Sabotage("lambert: 1/pi", "lambert", "0.318309886183790672", "0.318469041"),
    Sabotage("lambert: light below 0.6 degrees is dropped", "lambert", "NoL > 0.0 &&", "NoL > 0.01 &&"),
    Sabotage("measured: theta_h is not a root", "measured", "vec3(sqrt(theta_h), theta_d", "vec3(theta_h, theta_d"),
    Sabotage("measured: theta_d 1 % too large", "measured", "right_angles(0.5 * length(q)", "right_angles(0.505 * length(q)"),
    Sabotage("measured: binary logarithm", "measured", "exp2(textureLod(", "exp(textureLod("),
    Sabotage(
        "metal: extinction in F", "metal", "lessThan(eta, vec3(0.5))) - k * k", "lessThan(eta, vec3(0.5))) - 1.001 * k * k"
    ),
    Sabotage("metal: F without the p-polarised part", "metal", "0.5 * Rs * (1.0 +", "Rs + 0.0 * ("),
    Sabotage("metal: least roughness", "metal", "LEAST_ROUGHNESS = 0.01", "LEAST_ROUGHNESS = 0.5005"),
    Sabotage("metal: F0", "metal schlick", "(eta - 1.0) * (eta - 1.0) + k2", "(eta - 1.0) * (eta - 1.0) + 1.0005 * k2"),
    Sabotage("minnaert: exponent", "minnaert", "m.k - 1.0)", "m.k - 1.0005)"),
    Sabotage("oren_nayar: C2", "oren_nayar", "0.45 * s2", "0.450225 * s2"),
    Sabotage("oren_nayar: 0.33", "oren_nayar", "s2 + 0.33", "s2 + 0.3302"),
    Sabotage("oren_nayar: C3 1 % too large", "oren_nayar", "0.125 * s2", "0.12625 * s2"),
    Sabotage("oren_nayar: no interreflection", "oren_nayar", "one + m.kd * two", "vec3(one)"),
    Sabotage("oren_nayar_qualitative: 0.09", "oren_nayar_qualitative", "s2 + 0.09", "s2 + 0.0901"),
    Sabotage(
        "oren_nayar_qualitative: max by min",
        "oren_nayar_qualitative",
        "max(max(NoL, NoV), FLT_MIN)",
        "max(min(NoL, NoV), FLT_MIN)",
    ),
    Sabotage("paint: flakes", "paint", "m.flakes * ggx_cos", "1.0005 * m.flakes * ggx_cos"),
    Sabotage("paint: pigment", "paint", "1.0 - m.flakes) *", "1.0005 - m.flakes) *"),
    Sabotage("paint: coat passes once only", "paint", "* (bare + m.coat * interface_passes(NoV, ior))", ""),
    Sabotage("paint: F of the coat", "paint", "0.5 * A * A * (1.0 + B * B)", "0.5 * A * A * (1.0 + B)"),
    Sabotage("phong: exponent", "phong", "l, m.exponent)", "l, m.exponent * 1.0005)"),
    Sabotage("phong: series of the logarithm", "phong", "2.88539007", "2.88683277"),
    Sabotage("phong: mirrored about the tangent plane", "phong", "2.0 * NoV * f.n - v", "v - 2.0 * NoV * f.n"),
    Sabotage("phong: highlight of the side that faces away", "phong", "NoL > 0.0 && NoV > 0.0", "NoV > 0.0"),
    Sabotage("phong_normalised: norm", "phong_normalised", "0.5 * m.exponent + 1.0", "0.5 * m.exponent + 1.01"),
    Sabotage("plastic: internal reflection", "plastic", "0.333333313", "0.3337"),
    Sabotage("plastic: transmission", "plastic", "return 2.0 * ((c * s)", "return 2.001 * ((c * s)"),
    Sabotage("plastic: ior is not squared", "plastic", "ior * ior * (1.0 - m.kd)", "ior * (1.0 - m.kd)"),
    Sabotage("plastic, Schlick: 1/21", "plastic schlick", "1.0 / 21.0", "1.0 / 20.0"),
    Sabotage("principled: specular", "principled", "0.08 * m.specular", "0.08004 * m.specular"),
    Sabotage("principled: luminance", "principled", "vec3(0.3, 0.6, 0.1)", "vec3(0.3, 0.59, 0.11)"),
    Sabotage("principled: subsurface", "principled", "1.25 * INV_PI", "1.250625 * INV_PI"),
    Sabotage("principled: sheen", "principled", "m.sheen * fh", "1.0005 * m.sheen * fh"),
    Sabotage("principled: F0 of the clear coat", "principled", "0.04 + 0.96 * fh", "0.0404 + 0.9596 * fh"),
    Sabotage("principled: roughness of the clear coat", "principled", "0.099 * (1.0 - gloss)", "0.0991 * (1.0 - gloss)"),
    Sabotage("principled: width of G", "principled", "0.5 + 0.5 * roughness", "0.5 + 0.501 * roughness"),
    Sabotage("principled: anisotropy", "principled anisotropic", "0.9 * anisotropy", "0.8995 * anisotropy"),
    Sabotage("retro_ggx: direction", "retro_ggx", "2.0 * NoL * f.n - l", "2.001 * NoL * f.n - l"),
    Sabotage("retro_phong: exponent", "retro_phong", "0.5 * m.exponent)", "0.50025 * m.exponent)"),
    Sabotage("strauss: KF", "strauss", "KF = 0.12", "KF = 0.1201"),
    Sabotage("strauss: KG", "strauss", "KG = 0.01", "KG = 0.01001"),
    Sabotage("strauss: KJ", "strauss", "KJ = 0.1", "KJ = 0.10005"),
    Sabotage("strauss: exponent", "strauss", "3.0 / max(1.0 - s", "3.0015 / max(1.0 - s"),
    Sabotage("strauss: series of the arcsine", "strauss", "0.166669932", "0.166753267", found=False),
    Sabotage("ward: exponent of the cosines", "ward", "inversesqrt(low)", "1.0 / low"),
    Sabotage("ward: widths exchanged", "ward", "squares.x / (alpha_x * alpha_x)", "squares.x / (alpha_y * alpha_y)"),
    Sabotage("ward: width", "ward isotropic", "-0.5 * slope2", "-0.50025 * slope2"),
    Sabotage("ward_duer: norm", "ward_duer", "0.25 / (low", "0.250125 / (low"),
    Sabotage("ward_gmd: no tangent", "ward_gmd", "(1.0 + g.tan2)", "1.0"),
    # Lights.
    Sabotage("ambient light: intensity", "ambient", "return light.intensity;", "return light.intensity * 1.0005;"),
    Sabotage("directional: intensity", "directional", "return light.intensity;", "return light.intensity * 1.0005;"),
    Sabotage("directional: turned by 0.05 degrees", "directional", "l = light.l;", "l = light.l + 9e-4 * light.l.yzx;"),
    Sabotage("point: moved by 0.001", "point", "unit(light.position - p)", "unit(light.position - p + vec3(0.001, 0.0, 0.0))"),
    Sabotage(
        "point: falls off from the wrong side",
        "point 1/r",
        "light.position - p, light.r_min",
        "light.position + p, light.r_min",
    ),
    Sabotage("point: 1/r", "point 1/r", "max(length(to_light), r_min)", "max(1.0005 * length(to_light), r_min)"),
    Sabotage(
        "point: exponent of 1/r^2",
        "point 1/r^2",
        "1.0 / max(dot(to_light, to_light)",
        "1.0 / max(pow(dot(to_light, to_light), 1.0005)",
    ),
    Sabotage("point: r_min is not squared", "point r_min", "r_min * r_min", "r_min"),
    Sabotage(
        "point: 1 of 70 lights is dropped",
        "70 points",
        "i < u_point_inverse_square_count",
        "i < u_point_inverse_square_count - 1",
    ),
    Sabotage(
        "point: 1 of 70 lights shines twice", "70 points", "c += e * brdf_cos", "c += (i == 33 ? 2.0 : 1.0) * e * brdf_cos"
    ),
    Sabotage("spot: cone wider by 0.2 %", "spot", "light.cone_outer - 0.5", "1.004 * light.cone_outer - 0.5"),
    Sabotage("spot: linear edge", "spot", "x * x * (3.0 - 2.0 * x)", "x"),
    Sabotage("gltf_spot: cone wider by 0.2 %", "gltf_spot", "light.cone_outer - 0.5", "1.004 * light.cone_outer - 0.5"),
    Sabotage("gltf_spot: edge is not squared", "gltf_spot", "x * x", "x"),
    # Geometry, viewer, horizon and rates.
    Sabotage(
        "normals transformed like positions",
        "stretched",
        "u_normal_from_object * n_object",
        "mat3(u_world_from_object) * n_object",
    ),
    Sabotage("normals are not made unit", "stretched", "unit(v_normal)", "v_normal"),
    Sabotage(
        "field of view larger by 0.1 %",
        "phong",
        "vec4(world(a_position), 1.0);",
        "vec4(world(a_position), 1.0) * vec4(0.999, 0.999, 1.0, 1.0);",
    ),
    Sabotage(
        "picture moved by 1/10 pixel",
        "phong",
        "return u_clip_from_world * vec4(world(a_position), 1.0);",
        "vec4 q = u_clip_from_world * vec4(world(a_position), 1.0); return q + vec4(0.2 / 160.0 * q.w, 0.0, 0.0, 0.0);",
    ),
    Sabotage(
        "depth reversed",
        "crossing",
        "return u_clip_from_world * vec4(world(a_position), 1.0);",
        "vec4 q = u_clip_from_world * vec4(world(a_position), 1.0); return vec4(q.xy, q.w - q.z, q.w);",
    ),
    Sabotage("viewer moved by 0.002", "phong", "unit(-p)", "unit(vec3(0.002, 0.0, 0.0) - p)"),
    Sabotage(
        "orthographic viewer as if in perspective", "orthographic", "return u_viewer;", "return unit(u_viewer - 0.01 * p);"
    ),
    Sabotage("viewers below the horizon are not raised", "coarse", "max(2e-3 - 2.0 * dot(n, v), 0.0)", "0.0"),
    Sabotage("the test of n.v alone is dropped", "lambert", "&& dot(f.n, v) > 0.0", "", found=False),
    Sabotage("gouraud: interpolated without perspective", "gouraud", "centroid ", "noperspective "),
    Sabotage("gouraud: brightness", "gouraud", "v_radiance = radiance(1.0)", "v_radiance = radiance(1.0) * 1.0005"),
    Sabotage("flat: light of a corner, not of the centroid", "flat", "world(a_centroid)", "world(a_position)"),
    Sabotage("flat: brightness", "flat", "v_radiance = radiance(1.0)", "v_radiance = radiance(1.0) * 1.0005"),
    Sabotage("back faces have front faces' normals", "both sides", "gl_FrontFacing ? 1.0 : -1.0", "1.0"),
    Sabotage(
        "gouraud: back faces have front faces' light", "both sides gouraud", "gl_FrontFacing ? v_front : v_back", "v_front"
    ),
    Sabotage("flat: back faces have front faces' light", "both sides flat", "faces_viewer() ? 1.0 : -1.0", "1.0"),
    # Textures, colours and alpha.
    Sabotage(
        "texture is decoded twice",
        "colour texture",
        "texture(u_kd_texture, v_uv).rgb",
        "pow(texture(u_kd_texture, v_uv).rgb, vec3(2.2))",
    ),
    Sabotage(
        "texture is moved by half a texel",
        "colour texture",
        "u_kd_texture, v_uv)",
        "u_kd_texture, v_uv + vec2(0.5 / 512.0, 0.0))",
    ),
    Sabotage("texture is upside down", "colour texture", "u_kd_texture, v_uv)", "u_kd_texture, vec2(v_uv.x, 1.0 - v_uv.y))"),
    Sabotage("green of a normal map reversed", "normal map", "f.b * (scale * m.y)", "f.b * (-scale * m.y)"),
    Sabotage("normal map 3 % too strong", "normal map", "scale * m.x", "1.03 * scale * m.x"),
    Sabotage("normal map's zero at 127.5/256", "normal map", "2.0 * rgb - 1.0", "2.0 * rgb - 0.996"),
    Sabotage("bump map 3 % too strong", "bump map", "f.n * m.z", "f.n * (m.z / 1.03)"),
    Sabotage("handedness of a mirrored object", "mirrored normal map", "u_handedness * t_object.w", "t_object.w"),
    Sabotage("roughness from another channel", "channel", "v_uv).g", "v_uv).b"),
    Sabotage(
        "direction map is read as x and -y",
        "direction map",
        "texture(u_direction_map, v_uv).rg",
        "vec2(texture(u_direction_map, v_uv).r, 1.0 - texture(u_direction_map, v_uv).g)",
    ),
    Sabotage("tangent turned the other way", "turned", "d.x * f.t + d.y * f.b", "d.x * f.t - d.y * f.b"),
    Sabotage("vertex colours", "vertex colours", "* v_colour.rgb", "* v_colour.rgb * 1.0005"),
    Sabotage("vertex colours are decoded", "vertex colours", "* v_colour.rgb", "* pow(v_colour.rgb, vec3(2.2))"),
    Sabotage("alpha cutoff", "mask", "< u_alpha_cutoff", "< u_alpha_cutoff + 0.01"),
    Sabotage("blended colour is not premultiplied", "blend", "vec4(c * alpha, alpha)", "vec4(c, alpha)"),
    Sabotage("alpha", "blend", "return u_alpha *", "return 1.0005 * u_alpha *"),
    Sabotage("exposure", "exposed", "vec4(c * alpha, alpha)", "vec4(c * 1.0005, alpha)"),
)
