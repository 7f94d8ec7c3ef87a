"""Plan: what a scene's programs must hold, and nothing else.

A ProgramPlan is frozen and hashable: equal plans are one program. Values (colours, exponents, positions) are not in it,
they are uniforms; what changes the text of a program is.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from glshade.assembly.assembly import Assembly, Instance, Shows
from glshade.assembly.values import ambient_reflectance, turn
from glshade.brdfs import BRDFS, Brdf
from glshade.lights import Falloff, Light
from glshade.radiance.readying import ready
from glshade.scene.camera import View
from glshade.scene.scene import Rate, Scene
from glshade.textures.texels import Texels, texels
from glshade.textures.texture import DirectionMap, Texture

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
# A page of lights in a uniform block: 16 KiB is what every driver has, and a spot light, the largest, takes 64 bytes.
PAGE = 256
Viewer = Literal["perspective", "perspective_close", "orthographic"]
# The square of a shorter way to the viewer comes near to what float32 flushes to 0; nothing nearer than the near plane is seen.
CLOSEST = 1e-15

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
    arithmetic: fast puts textbook forms in place of the stable ones. shows: light, or what else of the surface in its place.
    """

    rate: Rate
    brdf: str
    slots: tuple[tuple[str, str], ...]
    parameters: tuple[tuple[str, str], ...]
    lights: tuple[LightGroup, ...]
    ambient: Literal["none", "constant", "varying"]
    viewer: Viewer
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
    shows: Shows = "light"

    @property
    def directed(self) -> bool:
        """Whether any light comes from a direction, so that normal and viewer matter."""
        return bool(self.lights) or self.shows == "normal"

    @property
    def positions(self) -> bool:
        """Whether the shading needs to know where the point is."""
        if self.shows == "normal":
            # A face seen from both sides asks where the viewer is.
            return self.rate == "flat" and self.both_sides and self.viewer != "orthographic"
        if self.shows == "depth":
            return True
        placed = any(group.falloff != "none" or group.type != "directional" for group in self.lights)
        return placed or (self.directed and self.viewer != "orthographic")

    @property
    def tangents(self) -> bool:
        """Whether the shading frame needs tangents."""
        return self.directed and (self.normal_map or self.anisotropic)

    @property
    def textured(self) -> tuple[str, ...]:
        """The parameters that are textures."""
        return tuple(name for name, use in self.parameters if channel(use) is not None)

    @property
    def coloured(self) -> bool:
        """Whether the shading looks at vertex colours, which multiply the model's base."""
        declared = BRDFS[self.brdf].parameters()
        return self.vertex_colours and any(declared[name].base and use != "unused" for name, use in self.parameters)

    @property
    def mapped(self) -> bool:
        """Whether the shading reads any texture."""
        return bool(self.textured) or self.normal_map or self.direction_map or self.shows == "uv"

    def picture_of(self, name: str) -> str:
        """The parameter under whose name the texture of `name` is bound."""
        return dict(self.shared).get(name, name)

    @property
    def parts(self) -> tuple[str, ...]:
        """What the model's places are filled with, by file names."""
        return tuple(name for _, text in self.slots for name in _INCLUDED.findall(text))

    def __str__(self) -> str:
        lights = [f"{group.count or 'many'} {group.key}" for group in self.lights] + ["ambient"] * (self.ambient != "none")
        channels = {name: channel(use) for name, use in self.parameters}
        extras = [f"{name} textured" + f" ({channels[name]})" * bool(channels[name]) for name in self.textured]
        extras += ["normal map" + " (mirrored)" * (self.normal_span != (1, 1))] * self.normal_map
        extras += ["tangents by a map"] * self.direction_map + ["tangents turned"] * self.turned
        extras += ["vertex colours"] * self.vertex_colours
        extras += ["normals not normalised"] * (not self.normalise) + ["fast arithmetic"] * (self.arithmetic == "fast")
        extras += ["both sides"] * self.both_sides + [f"alpha {self.alpha}"] * (self.alpha != "opaque")
        model = self.brdf + f" ({', '.join(self.parts)})" * bool(self.parts)
        if self.shows != "light":
            return ", ".join([f"{self.shows} per {PER[self.rate]}", self.viewer, *extras])
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
    if instance.shows != "light":
        return _bare(instance, assembly, encoding)
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
    # Where no texture or vertex colour takes part, ambient light adds one colour, which is worked out beforehand.
    base = model.base()
    seen = _with_equals(material, material.asked("ambient"))
    varies = (instance.vertex_colours and base in seen) or any(isinstance(getattr(material, name), Texture) for name in seen)
    how: Literal["none", "constant", "varying"] = "varying" if ambient and varies else "none"
    if ambient and not varies and ambient_reflectance(material).any():
        how = "constant"
    asked = _with_equals(material, material.asked("light")) if groups else frozenset()
    asked |= seen if how == "varying" else frozenset()
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
    carries_alpha = material.alpha_mode != "opaque" and base is not None and isinstance(getattr(material, base), Texture)
    vertex_colours = instance.vertex_colours and (base in asked or material.alpha_mode != "opaque")
    # One alpha everywhere, and enough of it: nothing is cut out.
    whole = not (carries_alpha or vertex_colours) and material.alpha >= material.alpha_cutoff
    bumpy = (material.normal_map is not None or material.bump_map is not None) and bool(groups)
    tangents = material.needs_tangents and bool(groups)
    return ProgramPlan(
        rate=instance.rate,
        brdf=material.brdf,
        slots=tuple(material.slots().items()) if groups or how == "varying" else (),
        parameters=tuple(parameters),
        lights=tuple(groups),
        ambient=how,
        viewer=_viewer(assembly.view),
        both_sides=instance.back_faces and bool(groups),
        alpha="opaque" if material.alpha_mode == "mask" and whole else material.alpha_mode,
        alpha_from=base if carries_alpha else None,
        vertex_colours=vertex_colours,
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


def _viewer(view: View) -> Viewer:
    if not view.perspective:
        return "orthographic"
    return "perspective" if view.near >= CLOSEST else "perspective_close"


def _bare(instance: Instance, assembly: Assembly, encoding: Literal["linear", "srgb"]) -> ProgramPlan:
    """The program that shows something else than light: no model and no light is in it, but what is cut out is."""
    material = instance.material
    base = material.base()
    masked = material.alpha_mode == "mask"
    carries_alpha = masked and base is not None and isinstance(getattr(material, base), Texture)
    vertex_alpha = masked and instance.vertex_colours
    whole = not (carries_alpha or vertex_alpha) and material.alpha >= material.alpha_cutoff
    normal = instance.shows == "normal"
    return ProgramPlan(
        rate=instance.rate,
        brdf=material.brdf,
        slots=(),
        parameters=(),
        lights=(),
        ambient="none",
        viewer=_viewer(assembly.view),
        both_sides=normal and instance.back_faces,
        alpha="mask" if masked and not whole else "opaque",
        alpha_from=base if carries_alpha else None,
        vertex_colours=vertex_alpha,
        normal_map=normal and bool(material.normal_map or material.bump_map),
        anisotropic=False,
        encoding=encoding,
        normal_span=texels(material, "bump_map").span if normal and material.bump_map else (1, 1),
        shows=instance.shows,
    )


def _with_equals(material: Brdf, asked: frozenset[str]) -> frozenset[str]:
    """The parameters that are asked for, and those that they equal where they are left out."""
    declared = material.parameters()
    return asked | {declared[name].same_as or name for name in asked if getattr(material, name) is None}


def explain(scene: Scene, shading: Rate | None = None) -> Plan:
    """What the programs of a scene hold, and why.

    Errors: SceneError.
    """
    assembly = ready(scene, shading)
    film, storage = scene.film, scene.quality.storage
    # What is averaged, blended or added afterwards is drawn in linear light.
    direct = film.direct and storage in (None, "auto")
    direct &= not any(i.material.alpha_mode == "blend" or _has_pages(i, assembly) for i in assembly.instances)
    return plan(assembly, film.encoding if direct else "linear")


def _has_pages(instance: Instance, assembly: Assembly) -> bool:
    """Whether there are more lights of a kind than one draw takes."""
    if not instance.material.asked("light"):
        return False
    reached = (assembly.lights[i] for i in instance.lights)
    return max(Counter(kind(light) for light in reached if not light.omnidirectional).values(), default=0) > PAGE


def plan(assembly: Assembly, encoding: Literal["linear", "srgb"]) -> Plan:
    """The plan of an assembled scene."""
    programs: dict[ProgramPlan, int] = {}
    draws: list[tuple[str, int]] = []
    why: dict[str, str] = {}
    for instance in assembly.instances:
        program = plan_instance(instance, assembly, encoding)
        draws.append((instance.name, programs.setdefault(program, len(programs))))
        for feature, reason in reasons(program, instance, assembly):
            why.setdefault(feature, reason)
    return Plan(tuple(programs), tuple(draws), tuple(why.items()))


def reasons(program: ProgramPlan, instance: Instance, assembly: Assembly) -> Iterator[tuple[str, str]]:
    """(feature, what requires it) of a program that draws the instance: an object, a light, the camera or the film."""
    name, material = instance.name, instance.material

    def light(index: int) -> str:
        return assembly.lights[index].name or f"lights[{index}]"

    yield f"brdf {program.brdf} per {PER[program.rate]}", name
    for part in program.parts:
        yield f"{program.brdf}'s {part}", name
    for parameter in program.textured:
        yield f"texture of {parameter}", name
    if program.normal_map:
        yield "bump map" if material.bump_map else "normal map", name
    if program.direction_map:
        yield "directions of tangents", name
    if program.turned:
        yield "tangents turned", f"{name}, by {turn(material):g} degrees"
    if program.vertex_colours:
        yield "vertex colours", name
    if program.both_sides:
        yield "both sides", f"{name}, whose mesh is open, or seen from inside, or told so"
    if program.alpha != "opaque":
        yield f"alpha {program.alpha}", name
    if program.alpha_from:
        yield f"alpha of {program.alpha_from}'s texture", name
    if not program.normalise:
        yield "normals not normalised", f"{name}, by quality.normalise"
    if program.arithmetic == "fast":
        yield "fast arithmetic", f"{name}, by quality.arithmetic"
    for group in program.lights:
        yield f"light {group.key}", light(next(i for i in instance.lights if group.holds(assembly.lights[i])))
    if program.ambient != "none":
        yield "light ambient", light(next(i for i in instance.lights if assembly.lights[i].omnidirectional))
    if program.directed:
        yield program.viewer, "camera"
    yield program.encoding, "film"
