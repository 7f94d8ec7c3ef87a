"""Variants: the number of programs that a scene's models and kinds of light allow, and the number that the scene has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal, get_args

from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.brdfs import BRDFS, Brdf, Parameter
from glshade.glsl.plan import EXACT_LIGHTS, Plan, kind
from glshade.glsl.planner import plan_instance
from glshade.scene.scene import Scene


@dataclass(frozen=True)
class Variants:
    """Numbers of programs, from the possible ones to the compiled ones.

    nominal: all combinations of all settings, for the scene's models and kinds of light, as if one shader had a switch for
        each setting (see `_knobs`).
    valid: the combinations that a scene can ask for. Some settings presuppose others: a normal map needs a light that has a
        direction, turned tangents need tangents. Lobes of weight 0 and textures that share a file are not counted separately.
    written: the distinct plans of this scene with its materials as they are written.
    canonical: the distinct plans of this scene with each material replaced by the simplest model of the same value.
    compiled: the distinct texts of the canonical plans, which the driver compiles. Programs for further pages of lights, where
        there are more than 256 of a kind, are not counted.
    """

    nominal: int
    valid: int
    written: int
    canonical: int
    compiled: int

    def as_dict(self) -> dict[str, int]:
        """Returns the attributes as a dictionary of JSON types."""
        return dict(vars(self))


def count_variants(scene: Scene, assembly: Assembly, plan: Plan, compiled: int) -> Variants:
    """Returns the numbers of programs of a scene.

    scene: the scene whose programs are counted.
    assembly: the assembled scene.
    plan: the plan of the scene.
    compiled: the number of distinct texts of the plan's programs.
    """
    models = sorted({_written(scene, instance).brdf for instance in assembly.instances} | {p.brdf for p in plan.programs})
    kinds = {kind(light) for light in assembly.lights if not light.ignores_normal}
    encoding = plan.programs[0].encoding
    written = {
        # Spectra do not choose among programs: the shares of an instance have the same written material.
        plan_instance(replace(instance, material=_written(scene, instance)), assembly, encoding)
        for instance in assembly.instances
    }
    return Variants(
        nominal=sum(math.prod(_knobs(BRDFS[name], len(kinds)).values()) for name in models),
        valid=sum(valid(BRDFS[name], len(kinds)) for name in models),
        written=len(written),
        canonical=len(plan.programs),
        compiled=compiled,
    )


def _written(scene: Scene, instance: Instance) -> Brdf:
    """Returns the material of an instance as the scene file gives it, with RGB colours in place of spectra.

    A material from a mesh file is taken as it is drawn.
    """
    given = scene.objects[instance.number].material
    material = scene.materials[given] if isinstance(given, str) else given
    return instance.quality.material(material).in_rgb() if material is not None else instance.material


def _light_counts(kinds: int) -> int:
    """Returns the number of combinations of light counts. A kind of light has at most 8 white and coloured lights together, or
    many.
    """
    return int(((EXACT_LIGHTS + 1) * (EXACT_LIGHTS + 2) // 2 + 1) ** kinds)


def _options(model: type[Brdf]) -> int:
    """Returns the number of combinations of the model's options."""
    return math.prod(len(get_args(model.model_fields[name].annotation)) for name in model.choices())


def _knobs(model: type[Brdf], kinds: int) -> dict[str, int]:
    """Setting -> the number of its values.

    A colour is three numbers, one number or a texture; a number is itself or one of a texture's four channels. Either may also
    be unused, and, where the model declares it, equal to another parameter.
    """
    uses = {
        f"use of {name}": (3 if model.is_colour(name) else 5) + 1 + (parameter.same_as is not None)
        for name, parameter in model.parameters().items()
    }
    return uses | {
        "options": _options(model),
        "lights": _light_counts(kinds),
        "ambient": 3,
        "alpha": 3,
        "rate": 3,
        "viewer": 2,
        "encoding": 2,
        "both_sides": 2,
        "alpha_from": 2,
        "vertex_colours": 2,
        "normal_map": 2,
        "anisotropic": 2,
        "turned": 2,
        "direction_map": 2,
        "normalise": 2,
        "arithmetic": 2,
        # Unused, one number, three numbers or a texture; unused or one of a texture's four channels.
        "emission": 4,
        "occlusion": 5,
    }


def valid(model: type[Brdf], kinds: int) -> int:
    """Returns the number of combinations of the settings that `plan_instance` can return for a model.

    model: the reflectance model.
    kinds: the number of kinds of light.
    """
    switch, total = (False, True), 0
    for directed, ambient, alpha, carried, coloured in product(
        switch, ("none", "constant", "varying"), ("opaque", "mask", "blend"), switch, switch
    ):
        lights, options = (_light_counts(kinds) - 1, _options(model)) if directed else (1, 1)
        if directed and not _asked(model, "light"):
            continue
        # Normals may stay unnormalised only with per-pixel shading and without a normal map or tangents.
        surfaces = sum(
            3 if normalised else 1
            for both, bumpy, tangents, turned, mapped, normalised, stable in product(switch, repeat=7)
            if (directed or (normalised and stable and not (both or bumpy or tangents)))
            and (model.anisotropic or not tangents)
            and (tangents or not (turned or mapped))
            and (normalised or not (bumpy or tangents))
        )
        # Two viewers, two encodings and four uses of emission go with each combination, and with ambient light also the uses of
        # occlusion.
        shown = 2 * 2 * 4 * (1 if ambient == "none" else 5)
        total += lights * surfaces * shown * options * _uses(model, directed, ambient, alpha != "opaque", carried, coloured)
    return total


def _uses(model: type[Brdf], directed: bool, ambient: str, cut: bool, carried: bool, coloured: bool) -> int:
    """Returns the number of ways to give the parameters that agree with the other settings.

    model: the reflectance model.
    directed: whether any light comes from a direction.
    ambient: the use of ambient light: none, constant or varying.
    cut: whether alpha has an effect.
    carried: whether the texture of the base colour holds alpha.
    coloured: whether vertex colours have an effect.
    """
    declared = model.parameters()
    by_light, by_ambient = _asked(model, "light"), _asked(model, "ambient")
    combinations: dict[tuple[str, ...], int] = {}
    base = next((name for name, parameter in declared.items() if parameter.base), None)
    # A parameter is given as numbers (a colour: three numbers or one), as a texture (a number: one of four channels), or left
    # out, so that it equals another one.
    numbers = {name: 2 if model.is_colour(name) else 1 for name in declared}
    textures = {name: 1 if model.is_colour(name) else 4 for name in declared}
    # The parameters on which the other settings depend are enumerated; the others only multiply the count.
    deciding = [name for name in declared if name == base or name in by_ambient or name in _equals(declared, by_ambient)]
    for choice in product(("numbers", "texture", "left out"), repeat=len(deciding)):
        given = dict(zip(deciding, choice, strict=True))
        if any(use == "left out" and declared[name].same_as is None for name, use in given.items()):
            continue
        seen = by_ambient | {declared[name].same_as or name for name in by_ambient if given[name] == "left out"}
        varies = (coloured and base in seen) or any(given[name] == "texture" for name in seen)
        asked = (by_light if directed else frozenset()) | (seen if ambient == "varying" else frozenset())
        asked |= {declared[name].same_as or name for name in asked if given.get(name) == "left out"}
        if (
            (ambient != "none" and varies != (ambient == "varying"))
            or carried != (cut and base is not None and given[base] == "texture")
            or (coloured and not (cut or base in asked))
        ):
            continue
        ways = 1
        for name in asked:
            if name in given:
                ways *= {"numbers": numbers[name], "texture": textures[name], "left out": 1}[given[name]]
            else:
                ways *= numbers[name] + textures[name] + (declared[name].same_as is not None)
        combinations[tuple(use if name in asked else "unused" for name, use in given.items())] = ways
    return sum(combinations.values())


def _asked(model: type[Brdf], by: Literal["light", "ambient"]) -> frozenset[str]:
    """Returns the parameters that a material of the model asks for if none of its lobes has weight 0."""
    return Brdf.asked(model.model_validate({}), by)


def _equals(declared: Mapping[str, Parameter], names: frozenset[str]) -> frozenset[str]:
    """For each named parameter, the one whose value it takes if it is left out; the parameter itself if there is none."""
    return frozenset(declared[name].same_as or name for name in names)
