"""Reasoning: names the object, light or setting that requires each feature of a program."""

from __future__ import annotations

from collections.abc import Iterator

from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.assembly.values import turn
from glshade.glsl.plan import PER, ProgramPlan


def reasons(program: ProgramPlan, instance: Instance, assembly: Assembly) -> Iterator[tuple[str, str]]:
    """Yields (feature, name of the object, light, camera or film that requires it) for a program that draws the instance."""
    name, material = instance.name, instance.material

    def light(index: int) -> str:
        return assembly.lights[index].name or f"lights[{index}]"

    yield f"brdf {program.brdf} per {PER[program.rate]}", name
    yield from instance.said
    for part in program.parts:
        yield f"{program.brdf}'s {part}", name
    if program.directed:
        yield from ((note.removesuffix("."), name) for note in material.notes())
    for parameter in program.textured:
        yield f"texture of {parameter}", name
    if program.emission in ("uniform", "grey"):
        yield "emission", name
    if program.placed:
        yield "textures placed by a matrix", f"{name}, by uv_scale, uv_rotate or uv_offset"
    if program.normal_map:
        yield "bump map" if material.bump_map else "normal map", name
    if program.direction_map:
        yield "directions of tangents", name
    if program.turned:
        yield "tangents turned", f"{name}, by {turn(material):g} degrees"
    if program.vertex_colours:
        yield "vertex colours", name
    if program.both_sides:
        yield "both sides", f"{name}, whose mesh is open or seen from inside, or whose sides are set to both"
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
    if material.unlit:
        yield "base colour in place of light", f"{name}, which is unlit"
    elif program.ambient != "none":
        yield "light ambient", light(next(i for i in instance.lights if assembly.lights[i].ignores_normal))
    if program.directed or program.sided:
        yield program.viewer, "camera"
    yield program.encoding, "film"
