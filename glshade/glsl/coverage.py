"""Coverage: plans that between them use every model, at every shading rate, with every light and every feature."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any, get_args

from glshade.assembly.instance import Shows
from glshade.brdfs import BRDFS, Brdf
from glshade.glsl.plan import LightGroup, ProgramPlan, Use, Viewer
from glshade.lights import FALLOFFS, LIGHTS
from glshade.scene.object import Rate

RATES: tuple[Rate, ...] = get_args(Rate)
VIEWERS: tuple[Viewer, ...] = get_args(Viewer)


def every_light(count: int) -> tuple[LightGroup, ...]:
    """Groups of `count` lights for every type and falloff, white and coloured.

    count: the number of lights in each group; 0 for lights in a uniform block, which have no white groups.
    """
    found = []
    for name, cls in LIGHTS.items():
        falloffs = tuple(FALLOFFS) if "falloff" in cls.model_fields else ("none",)
        for falloff, white in product(() if cls.ignores_normal else falloffs, (False, True) if count else (False,)):
            found.append(LightGroup(name, falloff, white, count))
    return tuple(found)


def plan_of_model(name: str, use: Use) -> ProgramPlan:
    """Returns the plan of a model with default values, all parameters used in one way, lit by one light of every kind.

    name: the name of the model.
    use: the way in which each parameter is used; the numbers of a texture come from its four channels in turn.
    """
    model = BRDFS[name]
    channels = {
        parameter: f"texture.{'rgba'[index % 4]}" if use == "texture" and not model.is_colour(parameter) else use
        for index, parameter in enumerate(model.parameters())
    }
    return ProgramPlan(
        rate="phong",
        brdf=name,
        slots=tuple(model.model_validate({}).slots().items()),
        parameters=tuple(channels.items()),
        lights=every_light(1),
        ambient="varying",
        viewer="perspective",
        both_sides=False,
        alpha="opaque",
        alpha_from=None,
        vertex_colours=False,
        normal_map=False,
        anisotropic=model.anisotropic,
        encoding="srgb",
    )


def covering_plans(names: tuple[str, ...] | None = None) -> Iterator[ProgramPlan]:
    """Plans that between them use every shader file that a scene can ask for.

    names: optional; the models. Default: all models.
    """
    chosen = tuple(BRDFS) if names is None else names
    for name in chosen:
        base = plan_of_model(name, "uniform")
        for slots in _slots(BRDFS[name]):
            yield from (replace(base, slots=slots, rate=rate) for rate in RATES)
            yield replace(base, slots=slots, arithmetic="fast")
        yield from (replace(base, rate=rate, lights=every_light(0), both_sides=True) for rate in RATES)
        yield from _with_textures(plan_of_model(name, "texture"))
    yield from _without_model(plan_of_model(chosen[0], "uniform"))


def _without_model(base: ProgramPlan) -> Iterator[ProgramPlan]:
    """Plans for the features that no model changes: viewers, encodings, and what is drawn in place of light."""
    yield from (replace(base, viewer=viewer, encoding="linear") for viewer in VIEWERS)
    dark = replace(base, slots=(), lights=(), ambient="none", encoding="linear", anisotropic=False)
    dark = replace(dark, parameters=tuple((name, "unused") for name, _ in base.parameters))
    yield from (dark, replace(dark, ambient="constant"))
    glow = replace(base, emission="texture", occlusion="texture.r")
    yield from (replace(glow, rate=rate) for rate in RATES)
    yield replace(dark, emission="grey", ambient="constant", occlusion="texture.a")
    yield replace(dark, emission="uniform")
    kinds: tuple[Shows, ...] = ("normal", "uv", "depth")
    yield from (replace(dark, parameters=(), shows=shows, rate=rate) for shows, rate in product(kinds, RATES))


def _with_textures(base: ProgramPlan) -> Iterator[ProgramPlan]:
    """Plans with maps, vertex colours and cut-outs. base: a plan whose parameters are textures."""
    first = base.parameters[0][0] if base.parameters else None
    for rate in RATES:
        yield replace(base, rate=rate, normal_map=True, vertex_colours=True, alpha="mask", alpha_from=first)
    yield replace(base, vertex_colours=True, alpha="blend", alpha_from=first)
    if base.anisotropic:
        yield from (replace(base, rate=rate, turned=True, direction_map=True) for rate in RATES)


def _slots(model: type[Brdf]) -> list[Any]:
    """Returns the different codes of the places in a model's file, found at the ends of its parameters' ranges and by its
    options.
    """
    tables: list[dict[str, Any]] = [{}, *_choices(model)]
    for name, declared in model.parameters().items():
        ends = {declared.low, declared.usual[1], declared.low if declared.high is None else declared.high}
        tables += [{name: end, **chosen} for end in sorted(ends) for chosen in _choices(model)]
    materials = [model.model_validate(table) for table in tables]
    return list(dict.fromkeys(tuple(material.slots().items()) for material in materials))


def _choices(model: type[Brdf]) -> list[dict[str, str]]:
    """Returns every combination of the model's options."""
    options = [[(name, value) for value in get_args(model.model_fields[name].annotation)] for name in model.choices()]
    return [dict(chosen) for chosen in product(*options)]
