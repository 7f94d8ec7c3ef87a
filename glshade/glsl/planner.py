"""Planner: makes the plan of each instance of a scene, in canonical form."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Literal

from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.assembly.values import ambient_reflectance, turn
from glshade.brdfs import BRDFS, Brdf
from glshade.glsl.plan import EXACT_LIGHTS, PAGE, LightGroup, Plan, ProgramPlan, Use, Viewer, channel, is_grey, is_white, kind
from glshade.glsl.reasoning import reasons
from glshade.glsl.uniforms import added, placed
from glshade.lights import Falloff, Light
from glshade.radiance.readying import ready
from glshade.scene.camera import View
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.textures.texels import Texels, placement_of, texels_of
from glshade.textures.texture import DirectionMap, Placement, Texture

# viewer/perspective.glsl is used only if the near plane is at least this far away, in the assembly's unit. The square of a
# shorter vector to the viewer comes close to the smallest normal float32 (1.2e-38). No visible point is nearer than the near
# plane.
CLOSEST = 1e-15


def plan_instance(instance: Instance, assembly: Assembly, encoding: Literal["linear", "srgb"]) -> ProgramPlan:
    """Returns the plan of the program for one instance, in canonical form: features that cannot show in the picture are left
    out.
    """
    if instance.shows != "light":
        return _bare(instance, assembly, encoding)
    material = instance.material
    model = BRDFS[material.brdf]
    base = model.base()
    reached = [assembly.lights[i] for i in instance.lights]
    seen = with_equals(material, material.asked("ambient"))
    varies = (instance.vertex_colours and base in seen) or any(isinstance(getattr(material, name), Texture) for name in seen)
    # The colour of ambient light cannot be computed on the CPU for a model that has only a GLSL file.
    varies |= bool(seen) and not material.has_reference
    answers_to_ambient = varies or (material.has_reference and ambient_reflectance(material).any())
    # Without textures and vertex colours, ambient light adds one colour, which is computed on the CPU.
    ambient: Literal["none", "constant", "varying"] = "none"
    if answers_to_ambient and any(light.ignores_normal for light in reached):
        ambient = "varying" if varies else "constant"
    # Some models reflect only ambient light, others only light from a direction.
    groups = _groups(
        light
        for light in reached
        if not light.ignores_normal and (answers_to_ambient if light.omnidirectional else material.asked("light"))
    )
    directed = any(not group.omnidirectional for group in groups)
    asked = with_equals(material, material.asked("light")) if directed else frozenset()
    if ambient == "varying" or any(group.omnidirectional for group in groups):
        asked |= seen
    parameters, shared = [], []
    pictures: dict[tuple[Texels, Placement], str] = {}
    for name, declared in model.parameters().items():
        value = getattr(material, name)
        if name not in asked:
            use: str = "unused"
        elif value is None and declared.same_as is not None:
            use = declared.same_as
        else:
            use = _use_of_colour(value) if model.is_colour(name) else _use_of_number(value)
            if isinstance(value, Texture):
                first = pictures.setdefault(_read_as(material, name), name)
                if first != name:
                    shared.append((name, first))
        parameters.append((name, use))
    emission, occlusion = "unused", "unused"
    if material.emits:
        emission = _use_of_colour(material.emission)
    from_all_round = ambient != "none" or any(group.omnidirectional for group in groups)
    if from_all_round and material.occlusion is not None and material.occlusion.strength:
        occlusion = f"texture.{material.occlusion.channel}"
    for name, use in (("emission", emission), ("occlusion", occlusion)):
        if channel(use) is not None and (first := pictures.setdefault(_read_as(material, name), name)) != name:
            shared.append((name, first))
    carries_alpha = material.alpha_mode != "opaque" and base is not None and isinstance(getattr(material, base), Texture)
    vertex_colours = instance.vertex_colours and (base in asked or material.alpha_mode != "opaque")
    # If alpha is the same everywhere and at least the cutoff, no fragment is cut out.
    whole = not (carries_alpha or vertex_colours) and material.alpha >= material.alpha_cutoff
    bumpy = (material.normal_map is not None or material.bump_map is not None) and bool(groups)
    tangents = material.needs_tangents and directed
    plan = ProgramPlan(
        rate=instance.rate,
        brdf=material.brdf,
        slots=tuple(material.slots().items()) if groups or ambient == "varying" else (),
        parameters=tuple(parameters),
        lights=groups,
        ambient=ambient,
        viewer=viewer_of(assembly.view),
        both_sides=instance.back_faces and bool(groups),
        alpha="opaque" if material.alpha_mode == "mask" and whole else material.alpha_mode,
        alpha_from=base if carries_alpha else None,
        vertex_colours=vertex_colours,
        normal_map=bumpy,
        anisotropic=tangents,
        encoding=encoding,
        shared=tuple(shared),
        normal_span=texels_of(material, "bump_map").span if bumpy and material.bump_map else (1, 1),
        turned=tangents and turn(material) % 360 != 0,
        direction_map=tangents and isinstance(material.tangent_direction, DirectionMap),
        normalise=instance.quality.normalise is not False or not groups or instance.rate != "phong" or bumpy or tangents,
        arithmetic=(instance.quality.arithmetic if groups else None) or "stable",
        emission=emission,
        occlusion=occlusion,
        weighted=instance.weights is not None,
    )
    return replace(plan, placed=placed(plan, material), added=added(plan, material))


def plans(assembly: Assembly, encoding: Literal["linear", "srgb"], scaled: bool = False) -> list[ProgramPlan]:
    """Returns the plan of every instance of an assembly, none of which has shares. Equal plans are one object.

    scaled: as in ProgramPlan.
    """
    known: dict[tuple[Any, ...], ProgramPlan] = {}
    equal: dict[ProgramPlan, ProgramPlan] = {}
    result = []
    for each in assembly.instances:
        # All that a plan depends on. Identities stand for values that take long to compare.
        weighted, quality = each.weights is not None, id(each.quality)
        key = id(each.material), each.lights, each.rate, each.back_faces, each.vertex_colours, quality, each.shows, weighted
        if key not in known:
            made = plan_instance(each, assembly, encoding)
            made = replace(made, scaled=True) if scaled else made
            known[key] = equal.setdefault(made, made)
        result.append(known[key])
    return result


def _read_as(material: Brdf, name: str) -> tuple[Texels, Placement]:
    """Returns the texels and the placement of a picture. Textures that agree in both are one texture of the program."""
    return texels_of(material, name), placement_of(material, name)


def _use_of_colour(value: Any) -> Use:
    """Returns the use of a colour: three numbers or a texture."""
    if isinstance(value, Texture):
        return "texture"
    return "grey" if is_grey(value) else "uniform"


def _use_of_number(value: Any) -> str:
    """Returns the use of a number or of a texture that holds a number in one channel."""
    return f"texture.{value.channel or 'r'}" if isinstance(value, Texture) else "uniform"


def further_plan(plan: ProgramPlan, instance: Instance, pages: Sequence[int], index: int) -> ProgramPlan:
    """Returns the plan of a further page of lights. The first call has already drawn emission, ambient light and groups with an
    exact count.

    plan: the plan of the first call.
    instance: the instance that is drawn.
    pages: the number of pages of each of plan.paged.
    index: the number of the page, from 1.
    """
    groups = tuple(group for group, count in zip(plan.paged, pages, strict=True) if index < count)
    asked: set[str] = set()
    for group in groups:
        asked |= with_equals(instance.material, instance.material.asked("ambient" if group.omnidirectional else "light"))
    parameters = tuple((name, use if name in asked else "unused") for name, use in plan.parameters)
    occlusion = plan.occlusion if any(group.omnidirectional for group in groups) else "unused"
    return replace(plan, lights=groups, ambient="none", parameters=parameters, emission="unused", occlusion=occlusion)


def _groups(lights: Iterable[Light]) -> tuple[LightGroup, ...]:
    """Returns the groups of the lights. At most EXACT_LIGHTS of a kind make a white and a coloured group, more make one paged
    group.
    """
    kinds: dict[tuple[str, Falloff], Counter[bool]] = {}
    for light in lights:
        kinds.setdefault(kind(light), Counter())[is_white(light)] += 1
    groups: list[LightGroup] = []
    for (name, falloff), counts in sorted(kinds.items()):
        if counts.total() > EXACT_LIGHTS:
            groups.append(LightGroup(name, falloff, False, 0))
        else:
            groups += [LightGroup(name, falloff, white, counts[white]) for white in (False, True) if counts[white]]
    return tuple(groups)


def viewer_of(view: View) -> Viewer:
    """Returns how a program computes the direction to the viewer."""
    if not view.perspective:
        return "orthographic"
    return "perspective" if view.near >= CLOSEST else "perspective_close"


def _bare(instance: Instance, assembly: Assembly, encoding: Literal["linear", "srgb"]) -> ProgramPlan:
    """Returns the plan of a program that shows a depth, normal or uv in place of light. It has no lights, but the same
    cut-outs.
    """
    material = instance.material
    base = material.base()
    masked = material.alpha_mode == "mask"
    carries_alpha = masked and base is not None and isinstance(getattr(material, base), Texture)
    vertex_alpha = masked and instance.vertex_colours
    whole = not (carries_alpha or vertex_alpha) and material.alpha >= material.alpha_cutoff
    normal = instance.shows == "normal"
    plan = ProgramPlan(
        rate=instance.rate,
        brdf=material.brdf,
        slots=(),
        parameters=(),
        lights=(),
        ambient="none",
        viewer=viewer_of(assembly.view),
        both_sides=normal and instance.back_faces,
        alpha="mask" if masked and not whole else "opaque",
        alpha_from=base if carries_alpha else None,
        vertex_colours=vertex_alpha,
        normal_map=normal and bool(material.normal_map or material.bump_map),
        anisotropic=False,
        encoding=encoding,
        normal_span=texels_of(material, "bump_map").span if normal and material.bump_map else (1, 1),
        shows=instance.shows,
    )
    return replace(plan, placed=placed(plan, material))


def with_equals(material: Brdf, asked: frozenset[str]) -> frozenset[str]:
    """Returns the parameters that are asked for. If one is left out, the parameter whose value it takes is included too."""
    declared = material.parameters()
    return asked | {declared[name].same_as or name for name in asked if getattr(material, name) is None}


def explain(scene: Scene, shading: Rate | None = None) -> Plan:
    """Returns the plan of a scene: its programs, and the reason for each of their features.

    scene: the scene to plan.
    shading: optional; replaces the shading rate of every object.
    Errors: SceneError.
    """
    assembly = ready(scene, shading)
    film, storage = scene.film, scene.quality.storage
    # Averaging samples, blending and adding pages of lights have to happen in linear light, before the encoding.
    direct = film.direct and storage in (None, "auto")
    direct &= not any(i.material.alpha_mode == "blend" or i.shares or _has_pages(i, assembly) for i in assembly.instances)
    return plan(assembly, film.encoding if direct else "linear")


def _has_pages(instance: Instance, assembly: Assembly) -> bool:
    """Returns whether the instance is lit by more lights of a kind than one draw call takes."""
    reached = (assembly.lights[i] for i in instance.lights)
    is_lit = bool(instance.material.asked("light"))
    counts = Counter(kind(light) for light in reached if not light.ignores_normal and (is_lit or light.omnidirectional))
    return max(counts.values(), default=0) > PAGE


def plan(assembly: Assembly, encoding: Literal["linear", "srgb"]) -> Plan:
    """Returns the plan of an assembled scene."""
    programs: dict[ProgramPlan, int] = {}
    draws: list[tuple[str, int]] = []
    why: dict[str, str] = {}
    whole = replace(assembly, instances=tuple(part for instance in assembly.instances for part in instance.parts))
    for instance, program in zip(whole.instances, plans(whole, encoding), strict=True):
        draws.append((instance.name, programs.setdefault(program, len(programs))))
        for feature, reason in reasons(program, instance, assembly):
            why.setdefault(feature, reason)
    return Plan(tuple(programs), tuple(draws), tuple(why.items()))
