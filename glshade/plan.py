"""Plan: what a scene's programs must hold, and nothing else.

A ProgramPlan is frozen and hashable: equal plans are one program. Values (colours, exponents, positions) are not in it,
they are uniforms; what changes the text of a program is.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import Literal

from glshade.assembly import Assembly, Instance, assemble
from glshade.brdfs import BRDFS, Brdf
from glshade.lights import Falloff, Light
from glshade.scene import Rate, Scene
from glshade.texels import Texels, texels
from glshade.texture import DirectionMap, Texture

# A uniform costs time in every pixel on a software driver, so a colour whose three channels are equal is one number.


def is_grey(colour: tuple[float, float, float]) -> bool:
    """Whether the three channels are equal."""
    return colour[0] == colour[1] == colour[2]


def is_white(light: Light) -> bool:
    """Whether the light is grey."""
    return is_grey(light.colour)


def kind(light: Light) -> tuple[str, Falloff]:
    """(type, falloff) of a light that has a direction."""
    return light.type, getattr(light, "falloff", "none")


# Up to here the count of lights is in the program, and its loop has a constant end; above, a uniform block holds a page.
EXACT_LIGHTS = 8

Use = Literal["uniform", "grey", "texture", "unused"]


def channel(use: str) -> str | None:
    """Of a use that is a texture's: the channel that a number is read from, "" for a colour's three; None for other uses."""
    kind, _, which = use.partition(".")
    return which if kind == "texture" else None


@dataclass(frozen=True, order=True)
class LightGroup:
    """Lights of one kind. white: their intensity is one number. count 0: a page of a uniform block, counted when drawn."""

    type: str
    falloff: Falloff
    white: bool
    count: int

    @property
    def key(self) -> str:
        """In identifiers: `point_inverse_square`, `white_directional`."""
        falloff = {"none": "", "1/r": "_inverse", "1/r^2": "_inverse_square"}[self.falloff]
        return "white_" * self.white + self.type + falloff

    def holds(self, light: Light) -> bool:
        """Whether the light is one of them."""
        return (self.type, self.falloff) == kind(light) and (self.count == 0 or self.white == is_white(light))


@dataclass(frozen=True)
class ProgramPlan:
    """What one program holds.

    slots: (place, GLSL) that the model's file leaves to the material. parameters: (name, use) in the struct's order; use may
    also be the name of the parameter it equals, and names a number's channel: "texture.g". shared: (parameter, the one whose
    picture it reads too). alpha_from: the parameter whose texture carries alpha. ambient: constant where it adds the same
    colour everywhere. normal_map: bump maps are normal maps by then; normal_span: how often the unit of texture coordinates
    goes into its texels. turned: the tangent, by one angle; direction_map: by a picture. normalise: interpolated normals.
    arithmetic: fast puts textbook forms in place of the stable ones.
    """

    rate: Rate
    brdf: str
    slots: tuple[tuple[str, str], ...]
    parameters: tuple[tuple[str, str], ...]
    lights: tuple[LightGroup, ...]
    ambient: Literal["none", "constant", "varying"]
    viewer: Literal["perspective", "orthographic"]
    both_sides: bool
    alpha: Literal["opaque", "mask", "blend"]
    alpha_from: str | None
    vertex_colours: bool
    normal_map: bool
    anisotropic: bool
    encoding: Literal["linear", "srgb"]
    shared: tuple[tuple[str, str], ...] = ()
    normal_span: tuple[int, int] = (1, 1)
    turned: bool = False
    direction_map: bool = False
    normalise: bool = True
    arithmetic: Literal["stable", "fast"] = "stable"

    @property
    def directed(self) -> bool:
        """Whether any light comes from a direction, so that normal and viewer matter."""
        return bool(self.lights)

    @property
    def positions(self) -> bool:
        """Whether the shading needs to know where the point is."""
        placed = any(group.falloff != "none" or group.type != "directional" for group in self.lights)
        return placed or (self.directed and self.viewer == "perspective")

    @property
    def tangents(self) -> bool:
        """Whether the shading frame needs tangents."""
        return self.directed and (self.normal_map or self.anisotropic)

    @property
    def textured(self) -> tuple[str, ...]:
        """The parameters that are textures."""
        return tuple(name for name, use in self.parameters if channel(use) is not None)

    @property
    def mapped(self) -> bool:
        """Whether the shading reads any texture."""
        return bool(self.textured) or self.normal_map or self.direction_map

    def picture_of(self, name: str) -> str:
        """The parameter under whose name the texture of `name` is bound."""
        return dict(self.shared).get(name, name)

    def __str__(self) -> str:
        lights = [f"{group.count or 'many'} {group.key}" for group in self.lights] + ["ambient"] * (self.ambient != "none")
        channels = {name: channel(use) for name, use in self.parameters}
        extras = [f"{name} textured" + f" ({channels[name]})" * bool(channels[name]) for name in self.textured]
        extras += ["normal map" + " (mirrored)" * (self.normal_span != (1, 1))] * self.normal_map
        extras += ["tangents by a map"] * self.direction_map + ["tangents turned"] * self.turned
        extras += ["vertex colours"] * self.vertex_colours
        extras += ["normals not normalised"] * (not self.normalise) + ["fast arithmetic"] * (self.arithmetic == "fast")
        extras += ["both sides"] * self.both_sides + [f"alpha {self.alpha}"] * (self.alpha != "opaque")
        parts = [name for _, text in self.slots for name in _INCLUDED.findall(text)]
        model = self.brdf + f" ({', '.join(parts)})" * bool(parts)
        return ", ".join(
            [f"{model} per {PER[self.rate]}", " + ".join(lights) or "no light", self.viewer, *extras, self.encoding]
        )


# What a slot includes, by its file's name.
_INCLUDED = re.compile(r'^#include ".*?(\w+)\.glsl"', re.MULTILINE)
PER = {"flat": "face", "gouraud": "vertex", "phong": "pixel"}


@dataclass(frozen=True)
class Plan:
    """The programs of a scene, and which object is drawn with which; reasons: (feature, what requires it)."""

    programs: tuple[ProgramPlan, ...]
    draws: tuple[tuple[str, int], ...]
    reasons: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        lines = []
        for index, program in enumerate(self.programs):
            names = [name for name, which in self.draws if which == index]
            shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
            lines.append(f"program {index}: {program}\n  draws {shown}")
        return "\n".join([*lines, *(f"{feature}: because of {reason}" for feature, reason in self.reasons)])


def plan_instance(instance: Instance, assembly: Assembly, encoding: Literal["linear", "srgb"]) -> ProgramPlan:
    """The program for one instance, in canonical form: what cannot show is left out."""
    reached = [assembly.lights[i] for i in instance.lights]
    ambient = any(light.omnidirectional for light in reached)
    kinds = Counter(kind(light) for light in reached if not light.omnidirectional)
    white = Counter(kind(light) for light in reached if not light.omnidirectional and is_white(light))
    material = instance.material
    model = BRDFS[material.brdf]
    # A model that answers only to ambient light never asks for another.
    if not material.asked("light"):
        kinds.clear()
    groups = []
    for (name, falloff), count in sorted(kinds.items()):
        if count > EXACT_LIGHTS:
            groups.append(LightGroup(name, falloff, False, 0))
            continue
        shares = {False: count - white[name, falloff], True: white[name, falloff]}
        groups += [LightGroup(name, falloff, grey, share) for grey, share in shares.items() if share]
    # Where no texture takes part, ambient light adds one colour, which is worked out beforehand.
    varies = instance.vertex_colours or any(isinstance(getattr(material, name), Texture) for name in model.parameters())
    how: Literal["none", "constant", "varying"] = "none" if not ambient else "varying" if varies else "constant"
    asked = material.asked("light") if groups else frozenset()
    asked |= material.asked("ambient") if how == "varying" else frozenset()
    asked |= {model.parameters()[name].same_as or name for name in asked if getattr(material, name) is None}
    parameters, shared = [], []
    pictures: dict[Texels, str] = {}
    for name, declared in model.parameters().items():
        value = getattr(material, name)
        if name not in asked:
            use: str = "unused"
        elif value is None and declared.same_as is not None:
            use = declared.same_as
        else:
            grey = model.is_colour(name) and not isinstance(value, Texture) and is_grey(value)
            use = "grey" if grey else "uniform"
            if isinstance(value, Texture):
                use = "texture" if model.is_colour(name) else f"texture.{value.channel or 'r'}"
                first = pictures.setdefault(texels(material, name), name)
                shared += [(name, first)] * (first != name)
        parameters.append((name, use))
    base = next((name for name, declared in model.parameters().items() if declared.base), None)
    carries_alpha = material.alpha_mode != "opaque" and base is not None and isinstance(getattr(material, base), Texture)
    bumpy = (material.normal_map is not None or material.bump_map is not None) and bool(groups)
    tangents = material.needs_tangents and bool(groups)
    return ProgramPlan(
        rate=instance.rate,
        brdf=material.brdf,
        slots=tuple(material.slots().items()) if groups or how == "varying" else (),
        parameters=tuple(parameters),
        lights=tuple(groups),
        ambient=how,
        viewer="perspective" if assembly.view.perspective else "orthographic",
        both_sides=instance.back_faces and bool(groups),
        alpha=material.alpha_mode,
        alpha_from=base if carries_alpha else None,
        vertex_colours=instance.vertex_colours and (bool(groups) or ambient or material.alpha_mode != "opaque"),
        normal_map=bumpy,
        anisotropic=tangents,
        encoding=encoding,
        shared=tuple(shared),
        normal_span=texels(material, "bump_map").span if bumpy and material.bump_map else (1, 1),
        turned=tangents and turn(material) % 360 != 0,
        direction_map=tangents and isinstance(material.tangent_direction, DirectionMap),
        normalise=instance.quality.normalise is not False or not groups or instance.rate != "phong" or bumpy or tangents,
        arithmetic=(instance.quality.arithmetic if groups else None) or "stable",
    )


def turn(material: Brdf) -> float:
    """How far the tangents, or the directions that take their place, are turned [degrees]."""
    direction = material.tangent_direction
    return direction.rotate if isinstance(direction, DirectionMap) else direction


def explain(scene: Scene, shading: Rate | None = None) -> Plan:
    """What the programs of a scene hold, and why.

    Errors: SceneError.
    """
    assembly = assemble(scene, shading)
    return plan(assembly, scene.film.encoding if scene.film.samples == 1 else "linear")


def plan(assembly: Assembly, encoding: Literal["linear", "srgb"]) -> Plan:
    """The plan of an assembled scene."""
    programs: dict[ProgramPlan, int] = {}
    draws: list[tuple[str, int]] = []
    reasons: dict[str, str] = {}
    for instance in assembly.instances:
        program = plan_instance(instance, assembly, encoding)
        draws.append((instance.name, programs.setdefault(program, len(programs))))
        reasons.setdefault(f"brdf {program.brdf} per {PER[program.rate]}", instance.name)
        for name in program.textured:
            reasons.setdefault(f"texture of {name}", instance.name)
        if program.normal_map:
            reasons.setdefault("bump map" if instance.material.bump_map else "normal map", instance.name)
        if program.direction_map:
            reasons.setdefault("directions of tangents", instance.name)
        if program.turned:
            reasons.setdefault("tangents turned", f"{instance.name}, by {turn(instance.material):g} degrees")
        if program.vertex_colours:
            reasons.setdefault("vertex colours", instance.name)
        if program.both_sides:
            reasons.setdefault("both sides", f"{instance.name}, whose mesh is open, or seen from inside, or told so")
        if program.alpha != "opaque":
            reasons.setdefault(f"alpha {program.alpha}", instance.name)
        for group in program.lights:
            first = next(i for i in instance.lights if group.holds(assembly.lights[i]))
            reasons.setdefault(f"light {group.key}", assembly.lights[first].name or f"lights[{first}]")
        if program.ambient != "none":
            first = next(i for i in instance.lights if assembly.lights[i].omnidirectional)
            reasons.setdefault("light ambient", assembly.lights[first].name or f"lights[{first}]")
    return Plan(tuple(programs), tuple(draws), tuple(reasons.items()))
