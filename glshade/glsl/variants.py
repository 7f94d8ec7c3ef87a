"""Variants: how many programs there might be of a scene's models and lights, and how many there are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal, get_args

from glshade.assembly.assembly import Assembly, Instance
from glshade.brdfs import BRDFS, Brdf, Parameter
from glshade.glsl.plan import EXACT_LIGHTS, Plan, kind, plan_instance
from glshade.scene.scene import Scene


@dataclass(frozen=True)
class Variants:
    """How many programs there might be, and how many there are.

    nominal: every value of every knob with every other, for the scene's models and kinds of light: as many as a shader with a
    switch for each would have. The knobs are the rate; each option of the model; what each parameter is (a colour: three
    numbers, one number, a texture; a number: itself, or a texture's r, g, b or a; unused; another one's equal); the count of
    each kind of light, white and coloured, up to 8, or many; ambient light (none, constant, varying); the viewer; both sides;
    alpha and whether a texture carries it; vertex colours; normal map; tangents; tangents turned; tangents by a map; whether
    normals are normalised; the arithmetic; the encoding.
    valid: those that a scene can ask for, since some knobs presuppose others: no normal map without a light that has a
    direction, no turned tangents without tangents. Lobes that a weight of nothing takes out, and textures that share a picture,
    are not counted apart.
    written, canonical: distinct plans of this scene, with its materials as they are written, and as the simplest models of the
    same value. compiled: distinct texts among these, which is what the driver compiles; further pages of lights, where there
    are more than 256 of a kind, have programs of their own.
    """

    nominal: int
    valid: int
    written: int
    canonical: int
    compiled: int

    def as_dict(self) -> dict[str, int]:
        """For JSON."""
        return dict(vars(self))


def variants(scene: Scene, assembly: Assembly, plan: Plan, compiled: int) -> Variants:
    """The counts of a scene, whose plan has so many distinct texts."""
    models = sorted({_written(scene, instance).brdf for instance in assembly.instances} | {p.brdf for p in plan.programs})
    kinds = {kind(light) for light in assembly.lights if not light.omnidirectional}
    encoding = plan.programs[0].encoding
    written = {
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
    """The material that the scene file gives the instance; a mesh file's own is taken as it is drawn."""
    given = scene.objects[instance.number].material
    material = scene.materials[given] if isinstance(given, str) else given
    return instance.quality.material(material) if material is not None else instance.material


def _light_counts(kinds: int) -> int:
    """How many lights of each kind: so many white and so many coloured ones, 8 together at most, or many."""
    return int(((EXACT_LIGHTS + 1) * (EXACT_LIGHTS + 2) // 2 + 1) ** kinds)


def _options(model: type[Brdf]) -> int:
    return math.prod(len(get_args(model.model_fields[name].annotation)) for name in model.choices())


def _knobs(model: type[Brdf], kinds: int) -> dict[str, int]:
    """knob -> how many values it has by itself."""
    uses = {name: (3 if model.is_colour(name) else 5) + 1 + (p.same_as is not None) for name, p in model.parameters().items()}
    return {
        **{f"use of {name}": count for name, count in uses.items()},
        **{"options": _options(model), "lights": _light_counts(kinds), "ambient": 3, "alpha": 3, "rate": 3},
        **dict.fromkeys(("viewer", "encoding", "both_sides", "alpha_from", "vertex_colours", "normal_map"), 2),
        **dict.fromkeys(("anisotropic", "turned", "direction_map", "normalise", "arithmetic"), 2),
    }


def valid(model: type[Brdf], kinds: int) -> int:
    """How many combinations of the knobs' values `plan_instance` can give."""
    switch, total = (False, True), 0
    for directed, ambient, alpha, carried, coloured in product(
        switch, ("none", "constant", "varying"), ("opaque", "mask", "blend"), switch, switch
    ):
        lights, options = (_light_counts(kinds) - 1, _options(model)) if directed else (1, 1)
        if directed and not _asked(model, "light"):
            continue
        # Normals are left as they are only per pixel, where they are interpolated and make no frame of tangents.
        surfaces = sum(
            3 if normalised else 1
            for both, bumpy, tangents, turned, mapped, normalised, stable in product(switch, repeat=7)
            if (directed or (normalised and stable and not (both or bumpy or tangents)))
            and (model.anisotropic or not tangents)
            and (tangents or not (turned or mapped))
            and (normalised or not (bumpy or tangents))
        )
        # The viewer, and the encoding.
        total += lights * surfaces * 2 * 2 * options * _uses(model, directed, ambient, alpha != "opaque", carried, coloured)
    return total


def _uses(model: type[Brdf], directed: bool, ambient: str, cut: bool, carried: bool, coloured: bool) -> int:
    """How many ways there are to give the parameters, so that the other knobs are as told.

    cut: alpha counts; carried: by the base's texture.
    """
    declared = model.parameters()
    by_light, by_ambient = _asked(model, "light"), _asked(model, "ambient")
    found: dict[tuple[str, ...], int] = {}
    base = next((name for name, parameter in declared.items() if parameter.base), None)
    # Of each parameter: given as numbers, as a texture, or left out and another's equal; the first two in several ways.
    numbers = {name: 2 if model.is_colour(name) else 1 for name in declared}
    pictures = {name: 1 if model.is_colour(name) else 4 for name in declared}
    # What decides on the other knobs is gone through, and what does not is multiplied.
    deciding = [name for name in declared if name == base or name in by_ambient or name in _equals(declared, by_ambient)]
    for given in product(("numbers", "texture", "left out"), repeat=len(deciding)):
        how = dict(zip(deciding, given, strict=True))
        if any(use == "left out" and declared[name].same_as is None for name, use in how.items()):
            continue
        seen = by_ambient | {declared[name].same_as or name for name in by_ambient if how[name] == "left out"}
        varies = (coloured and base in seen) or any(how[name] == "texture" for name in seen)
        asked = (by_light if directed else frozenset()) | (seen if ambient == "varying" else frozenset())
        asked |= {declared[name].same_as or name for name in asked if how.get(name) == "left out"}
        if (
            (ambient != "none" and varies != (ambient == "varying"))
            or carried != (cut and base is not None and how[base] == "texture")
            or (coloured and not (cut or base in asked))
        ):
            continue
        ways = 1
        for name in asked:
            if name in how:
                ways *= {"numbers": numbers[name], "texture": pictures[name], "left out": 1}[how[name]]
            else:
                ways *= numbers[name] + pictures[name] + (declared[name].same_as is not None)
        found[tuple(use if name in asked else "unused" for name, use in how.items())] = ways
    return sum(found.values())


def _asked(model: type[Brdf], by: Literal["light", "ambient"]) -> frozenset[str]:
    """What any material of the model asks for: no weight is nothing."""
    return Brdf.asked(model.model_validate({}), by)


def _equals(declared: Mapping[str, Parameter], names: frozenset[str]) -> frozenset[str]:
    """The parameters that these may equal."""
    return frozenset(declared[name].same_as or name for name in names)
