"""Plan: the features that the programs of a scene need, as hashable values.

Equal ProgramPlans share one program. A plan holds everything that changes a program's text, and nothing else: values such as
colours, exponents and positions are uniforms and do not belong to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Literal

from glshade.assembly.instance import Shows
from glshade.brdfs import BRDFS, Slot
from glshade.lights import FALLOFFS, LIGHTS, Falloff, Light
from glshade.scene.object import Rate

# If a kind has at most this many lights, the plan holds their exact count, and the program's loop has a constant end. More
# lights are read from a uniform block, a page of lights at a time.
EXACT_LIGHTS = 8
# Lights per page. Every driver offers uniform blocks of at least 16 KiB, and the largest light, a spot light, takes 64 bytes.
PAGE = 256
Viewer = Literal["perspective", "perspective_close", "orthographic"]

Use = Literal["uniform", "grey", "texture", "unused"]


def is_grey(colour: tuple[float, float, float]) -> bool:
    """Returns whether the three channels are equal. Such a colour is uploaded as one number, since a uniform costs llvmpipe
    time.
    """
    return colour[0] == colour[1] == colour[2]


def is_white(light: Light) -> bool:
    """Returns whether the light's colour is grey, so that its intensity is one number."""
    return is_grey(light.rgb)


def kind(light: Light) -> tuple[str, Falloff]:
    """Returns (type, falloff) of a light. An omnidirectional light has no position and the falloff "none"."""
    return light.type, "none" if light.omnidirectional else getattr(light, "falloff", "none")


def channel(use: str) -> str | None:
    """Returns the texture channel that a parameter's use names ("texture.g": "g"); "" for a colour texture, None for other
    uses.
    """
    source, _, name = use.partition(".")
    return name if source == "texture" else None


@dataclass(frozen=True, order=True)
class LightGroup:
    """The lights of one kind that a program adds up.

    type: the type of the lights.
    falloff: their falloff with distance.
    white: whether their intensities are grey, so that each is uploaded as one number.
    count: their exact number; 0 if a uniform block holds a page of the lights. Their number is then a uniform.
    """

    type: str
    falloff: Falloff
    white: bool
    count: int

    @property
    def key(self) -> str:
        """The group's name in GLSL identifiers, for example `point_inverse_square` or `white_directional`."""
        words = ["white" if self.white else "", self.type, FALLOFFS[self.falloff].name]
        return "_".join(filter(None, words))

    @property
    def omnidirectional(self) -> bool:
        """Whether the lights arrive from all directions, with a strength that depends on the normal alone."""
        return LIGHTS[self.type].omnidirectional

    def holds(self, light: Light) -> bool:
        """Returns whether the light belongs to the group."""
        return (self.type, self.falloff) == kind(light) and (self.count == 0 or self.white == is_white(light))


@dataclass(frozen=True)
class ProgramPlan:
    """The features of one program.

    rate: where the model is evaluated: once per face (flat), per vertex (gouraud) or per pixel (phong).
    brdf: the name of the model.
    slots: (place, code) for each `#include <place>` in the model's file.
    parameters: (name, use) in the order of the model's struct. A use is one of Use, the name of the parameter that this one
        equals, or, for a number from a texture, the texture with its channel ("texture.g").
    lights: the groups of lights.
    ambient: none, constant (one colour is added everywhere) or varying (the shader evaluates it).
    viewer: the way in which the direction to the viewer is computed.
    both_sides: whether back faces are drawn too.
    alpha: the alpha mode, opaque if nothing is cut out.
    alpha_from: the parameter whose texture holds alpha; None if no texture does.
    vertex_colours: whether vertex colours have an effect.
    normal_map: whether a normal map bends the normals. A bump map is converted to a normal map before.
    anisotropic: whether the model needs tangents.
    encoding: the encoding of the picture that is drawn.
    shared: (parameter, other parameter) for two that read the same texture. It is bound under the other parameter's name.
    normal_span: the number of units of u and of v that the normal map covers: 2 if it also holds a mirrored copy, else 1.
    turned: whether the tangents are rotated by one angle.
    direction_map: whether a texture rotates the tangents.
    normalise: whether interpolated normals are normalised.
    arithmetic: stable, or fast (textbook formulas in place of the numerically stable ones).
    shows: light, or the other property of the surface that is drawn in its place.
    emission: the use of the emission that every material has, one of Use; "unused" for a surface that emits no light.
    occlusion: the use of the map that multiplies ambient light: the texture with its channel ("texture.r"), or "unused".
    added: the textured parameters, or emission, to whose texels a number is added.
    placed: the samplers of the textures that are read at coordinates which a matrix makes from those of the mesh.
    scaled: whether values that are interpolated at the centroid may come with a wrong factor, which the fragment stage divides
        out.
    weighted: whether the three channels are bands of wavelengths, which a matrix turns into RGB in the end.
    """

    rate: Rate
    brdf: str
    slots: tuple[tuple[str, Slot], ...]
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
    emission: str = "unused"
    occlusion: str = "unused"
    added: tuple[str, ...] = ()
    placed: tuple[str, ...] = ()
    scaled: bool = False
    weighted: bool = False

    @property
    def oriented(self) -> bool:
        """Whether the shading needs the normal."""
        return bool(self.lights) or self.shows == "normal"

    @property
    def directed(self) -> bool:
        """Whether any light comes from a direction, so that the model is evaluated for the viewer's direction."""
        return any(not group.omnidirectional for group in self.lights)

    @property
    def sided(self) -> bool:
        """Whether the vertex stage must find out which side of a flat face the viewer sees."""
        return self.rate == "flat" and self.both_sides

    @property
    def positions(self) -> bool:
        """Whether the shading needs the position of the shaded point."""
        if self.shows == "depth":
            return True
        directed = [group for group in self.lights if not group.omnidirectional]
        placed = any(group.falloff != "none" or group.type != "directional" for group in directed)
        return placed or ((bool(directed) or self.sided) and self.viewer != "orthographic")

    @property
    def tangents(self) -> bool:
        """Whether the shading frame needs tangents."""
        return self.oriented and (self.normal_map or self.anisotropic)

    @property
    def textured(self) -> tuple[str, ...]:
        """The names of the parameters that are textures, and of emission and occlusion where they are."""
        uses = (*self.parameters, ("emission", self.emission), ("occlusion", self.occlusion))
        return tuple(name for name, use in uses if channel(use) is not None)

    @property
    def coloured(self) -> bool:
        """Whether the shading reads vertex colours, which multiply the model's base colour."""
        declared = BRDFS[self.brdf].parameters()
        return self.vertex_colours and any(declared[name].base and use != "unused" for name, use in self.parameters)

    @property
    def mapped(self) -> bool:
        """Whether the shading reads any texture."""
        return bool(self.textured) or self.normal_map or self.direction_map or self.shows == "uv"

    @property
    def paged(self) -> tuple[LightGroup, ...]:
        """The groups of lights that are read a page at a time."""
        return tuple(group for group in self.lights if group.count == 0)

    def picture_of(self, name: str) -> str:
        """Returns the parameter under whose name the texture of `name` is bound."""
        return dict(self.shared).get(name, name)

    @property
    def parts(self) -> tuple[str, ...]:
        """The names, without folder and suffix, of the files that fill the model's places."""
        return tuple(PurePosixPath(name).stem for _, slot in self.slots for name in slot.includes)

    def __str__(self) -> str:
        """One line for people: the model, its lights, the viewer and all other features."""
        if self.shows != "light":
            return ", ".join([f"{self.shows} per {PER[self.rate]}", self.viewer, *self._extras()])
        model = f"{self.brdf} ({', '.join(self.parts)})" if self.parts else self.brdf
        lights = [f"{group.count or 'many'} {group.key}" for group in self.lights]
        if self.ambient != "none":
            lights.append("ambient")
        lit_by = " + ".join(lights) or "no light"
        return ", ".join([f"{model} per {PER[self.rate]}", lit_by, self.viewer, *self._extras(), self.encoding])

    def _extras(self) -> list[str]:
        """Returns the optional features of the program, in words."""
        channels = {name: channel(use) for name, use in (*self.parameters, ("occlusion", self.occlusion))}
        textures = [f"{name} textured" + (f" ({channels[name]})" if channels.get(name) else "") for name in self.textured]
        present = {
            "textures placed by a matrix": bool(self.placed),
            f"numbers added to {', '.join(self.added)}": bool(self.added),
            "emission": self.emission in ("uniform", "grey"),
            "normal map" if self.normal_span == (1, 1) else "normal map (mirrored)": self.normal_map,
            "tangents by a map": self.direction_map,
            "tangents turned": self.turned,
            "vertex colours": self.vertex_colours,
            "normals not normalised": not self.normalise,
            "fast arithmetic": self.arithmetic == "fast",
            "bands of wavelengths": self.weighted,
            "both sides": self.both_sides,
            f"alpha {self.alpha}": self.alpha != "opaque",
        }
        return [*textures, *(feature for feature, is_present in present.items() if is_present)]


# Rate -> the element of the picture that the model is evaluated for.
PER = {"flat": "face", "gouraud": "vertex", "phong": "pixel"}


@dataclass(frozen=True)
class Plan:
    """The programs of a scene.

    programs: the plan of each program.
    draws: (name of the object, index into programs) for each instance, in drawing order.
    reasons: (feature, name of the object, light, camera or film that requires it).
    """

    programs: tuple[ProgramPlan, ...]
    draws: tuple[tuple[str, int], ...]
    reasons: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        lines = []
        for index, program in enumerate(self.programs):
            names = list(dict.fromkeys(name for name, drawn_with in self.draws if drawn_with == index))
            listed = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
            lines.append(f"program {index}: {program}\n  draws {listed}")
        return "\n".join([*lines, *(f"{feature}: because of {reason}" for feature, reason in self.reasons)])
