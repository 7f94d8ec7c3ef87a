"""Source: the text of a program's stages, and where each line came from. No GL.

The files under shaders/ are whole GLSL that any tool can read; a plan chooses among them, and what is left to write (the
uniforms, the light loops) is generated into the places that the passes name in angle brackets: `#include <surface>`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from glshade.brdfs import BRDFS, Parameter
from glshade.document import nearest
from glshade.errors import ShaderError
from glshade.glsl.definitions import unreached
from glshade.glsl.plan import PAGE as PAGE
from glshade.glsl.plan import LightGroup, ProgramPlan, channel
from glshade.lights import LIGHTS

# Inside a wheel the shaders lie beside this module; in a checkout, beside the package.
_PACKAGE = Path(__file__).parent.parent
_INSTALLED = _PACKAGE / "_shaders"
SHADERS = _INSTALLED if _INSTALLED.is_dir() else _PACKAGE.parent / "shaders"

_INCLUDE = re.compile(r'^\s*#include\s+(?:"([^"]+)"|<([^>]+)>)\s*$')


@dataclass(frozen=True)
class Stage:
    """One stage's text. lines[i]: (file, line) of the text's line i + 1; generated text has its name in brackets as file."""

    text: str
    lines: tuple[tuple[str, int], ...]

    def __hash__(self) -> int:
        # Asked once an object of a scene; a text remembers its own.
        return hash(self.text)

    def place(self, line: int) -> str:
        """`file:line` of a line of the text, counted from 1."""
        file, number = self.lines[min(max(line, 1), len(self.lines)) - 1]
        return f"{file}:{number}"


@dataclass(frozen=True)
class Source:
    """A program's text. Without a fragment stage, what the vertex stage writes is captured."""

    vertex: Stage
    fragment: Stage | None


def expand(name: str, generated: Mapping[str, str], root: Path | None = None, fast: bool = False) -> Stage:
    """The file `name` under the shader folder with its includes in place, each once.

    generated: text for the includes in angle brackets. fast: a file that has another of its name under fast/ gives way to it.
    Errors: ShaderError for a file that is not there.
    """
    root = root or SHADERS
    text: list[str] = []
    lines: list[tuple[str, int]] = []
    seen = {name}

    def read(path: str, asked_from: str) -> list[str]:
        try:
            return (root / path).read_text(encoding="utf-8").splitlines()
        except OSError:
            names = [str(p.relative_to(root)) for p in root.rglob("*") if p.is_file()]
            raise ShaderError(f'{asked_from}: no shader file "{path}"{nearest(path, names)}') from None

    def walk(file: str, source: list[str]) -> None:
        for number, line in enumerate(source, 1):
            include = _INCLUDE.match(line)
            if include is None:
                text.append(line)
                lines.append((file, number))
                continue
            path, slot = include.groups()
            path = f"fast/{path}" if fast and path and (root / "fast" / path).is_file() else path
            wanted = path or f"<{slot}>"
            if wanted in seen:
                continue
            seen.add(wanted)
            if path is not None:
                walk(str(root / path), read(path, f"{file}:{number}"))
            elif slot in generated:
                walk(wanted, generated[slot].splitlines())
            else:
                raise ShaderError(f"{file}:{number}: nothing is generated for <{slot}>{nearest(slot, generated)}")

    walk(str(root / name), read(name, name))
    return Stage("\n".join(text) + "\n", tuple(lines))


def without_unreached(stage: Stage) -> Stage:
    """The stage without the functions, structs and constants that its files define for others."""
    lines = stage.text.splitlines()
    gone = {i for one in unreached(lines) for i in range(one.first, one.end)}
    kept = [i for i in range(len(lines)) if i not in gone]
    return Stage("".join(f"{lines[i]}\n" for i in kept), tuple(stage.lines[i] for i in kept))


@lru_cache(maxsize=1024)
def generate(plan: ProgramPlan) -> Source:
    """The text of the program that `plan` describes. The same plan gives the same text."""
    name = plan.rate + ("_both" if plan.both_sides else "")
    slots = dict(plan.slots)
    if plan.rate == "phong":
        vertex = {"surface": _interpolated(plan)}
        fragment = {**slots, "surface": _shading(plan, _Interpolated(plan)) + _alpha(plan)}
        vertex_pass, fragment_pass = "phong.vert", f"{name}.frag"
    else:
        vertex = {**slots, "surface": _shading(plan, _AtVertex(plan)) + _alpha_inputs(plan, "out")}
        fragment = {"surface": _alpha_inputs(plan, "in") + _alpha(plan)}
        vertex_pass = f"{name}.vert"
        fragment_pass = f"{name}.frag" if plan.rate == "gouraud" else "flat.frag"
    fragment["output"] = f'#include "output/{plan.encoding}.glsl"\n'
    fast = plan.arithmetic == "fast"
    stages = (expand(f"pass/{vertex_pass}", vertex, fast=fast), expand(f"pass/{fragment_pass}", fragment, fast=fast))
    return Source(*map(without_unreached, stages))


class _Interpolated:
    """The names of a surface's quantities in the fragment stage."""

    def __init__(self, plan: ProgramPlan) -> None:
        self.position, self.normal, self.tangent = "v_position", "v_normal", "v_tangent"
        self.uv, self.colour = "v_uv", "v_colour"
        self.declarations = _varyings(plan, "in")


class _AtVertex:
    """The same in the vertex stage; a flat triangle is shaded at its centroid."""

    def __init__(self, plan: ProgramPlan) -> None:
        at = "a_centroid_" if plan.rate == "flat" else "a_"
        self.position = "world(a_centroid)" if plan.rate == "flat" else "world(a_position)"
        self.normal, self.tangent = "world_normal(a_normal)", "world_tangent(a_tangent)"
        self.uv, self.colour = f"{at}uv", f"{at}colour"
        attributes = [
            f"in {TYPES[name]} {at if name in ('uv', 'colour') else 'a_'}{name};"
            for name in _wanted(plan)
            if name != "position"
        ]
        attributes += ["in vec3 a_centroid;"] * (plan.rate == "flat" and plan.positions)
        self.declarations = "".join(f"{line}\n" for line in attributes) + _transforms(plan)


TYPES = {"position": "vec3", "normal": "vec3", "tangent": "vec4", "uv": "vec2", "colour": "vec4"}


def _wanted(plan: ProgramPlan) -> list[str]:
    """What the shading asks of a surface, in a fixed order."""
    wanted = ["position"] * plan.positions + ["normal"] * plan.directed + ["tangent"] * plan.tangents
    return wanted + ["uv"] * plan.mapped + ["colour"] * plan.coloured


def _varyings(plan: ProgramPlan, direction: str) -> str:
    return "".join(f"{_varying(name, direction)}\n" for name in _handed_on(plan))


def _handed_on(plan: ProgramPlan) -> list[str]:
    """What passes from the vertex to the fragment stage under phong: what the shading wants, and what alpha does."""
    names = _wanted(plan)
    return names + [name for name in _wanted_by_alpha(plan) if name not in names]


def _wanted_by_alpha(plan: ProgramPlan) -> list[str]:
    return ["uv"] * bool(plan.alpha_from) + ["colour"] * (plan.vertex_colours and plan.alpha != "opaque")


def _varying(name: str, direction: str) -> str:
    """centroid: with several samples a pixel, the middle of one at the rim may lie outside the triangle, where an attribute
    is extrapolated: negative light, stray highlights. Texture coordinates bear that, but not being moved: the level of detail
    is taken from their differences between pixels."""
    return f"{'' if name == 'uv' else 'centroid '}{direction} {TYPES[name]} v_{name};"


def _transforms(plan: ProgramPlan) -> str:
    text = ""
    if plan.directed:
        text += '#include "lib/normal_transform.glsl"\n'
    if plan.tangents:
        text += '#include "lib/tangent_transform.glsl"\n'
    return text


def _interpolated(plan: ProgramPlan) -> str:
    """The vertex stage under phong: hands on what the fragment stage asks for."""
    names = _handed_on(plan)
    values = {
        "position": "world(a_position)",
        "normal": "world_normal(a_normal)",
        "tangent": "world_tangent(a_tangent)",
        "uv": "a_uv",
        "colour": "a_colour",
    }
    lines = [f"in {TYPES[name]} a_{name};" for name in names if name != "position"]
    body = [f"    v_{name} = {values[name]};" for name in names]
    text = "\n".join(lines) + "\n" + _transforms(plan) + _varyings(plan, "out")
    return text + "\nvoid interpolate() {\n" + "\n".join(body) + "\n}\n"


def _material(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> str:
    model, struct = BRDFS[plan.brdf], BRDFS.class_name(plan.brdf)
    declared = model.parameters()
    text, body = f'#include "brdf/{plan.brdf}.glsl"\n', []
    bound: set[str] = set()
    for name, use in plan.parameters:
        colour = model.is_colour(name)
        kind, channels = ("vec3", "rgb") if colour else ("float", "r")
        value = f"u_{name}"
        if use == "unused":
            body.append(f"    m.{name} = {kind}(0.0);")
            continue
        if use in declared:
            body.append(f"    m.{name} = m.{use};")
            continue
        text += f"uniform {'float' if use == 'grey' else kind} u_{name};\n"
        if use == "grey":
            value = f"vec3({value})"
        which = channel(use)
        if which is not None:
            picture = plan.picture_of(name)
            if picture not in bound:
                bound.add(picture)
                text += f"uniform sampler2D u_{picture}_texture;\n"
            value = _bounded(f"{value} * texture(u_{picture}_texture, {at.uv}).{which or channels}", declared[name])
        if declared[name].base and plan.vertex_colours:
            value += f" * {at.colour}.rgb"
        body.append(f"    m.{name} = {value};")
    return text + f"\n{struct} material() {{\n    {struct} m;\n" + "\n".join(body) + "\n    return m;\n}\n"


def _bounded(value: str, declared: Parameter) -> str:
    """A texel beyond what a parameter may be counts as the nearest that it may."""
    low = repr(float(declared.low))
    return f"max({value}, {low})" if declared.high is None else f"clamp({value}, {low}, {float(declared.high)!r})"


def bound_for_shading(plan: ProgramPlan, name: str) -> bool:
    """Whether the shading already has a sampler of this parameter's name."""
    return name in {plan.picture_of(textured) for textured in plan.textured}


def _frame(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> str:
    text = '#include "lib/frame.glsl"\n#include "lib/unit.glsl"\n'
    if plan.normal_map:
        text += '#include "lib/normal_map.glsl"\nuniform sampler2D u_normal_map;\nuniform float u_normal_scale;\n'
    elif plan.tangents:
        text += '#include "lib/tangent_frame.glsl"\n'
    if plan.turned or plan.direction_map:
        text += '#include "lib/turned_frame.glsl"\n'
    if plan.direction_map:
        text += '#include "lib/direction_map.glsl"\nuniform sampler2D u_direction_map;\n'
    if plan.turned:
        text += "uniform vec2 u_turn;\n"
    text += "\n// side: -1 turns the normal over.\nFrame frame(float side) {\n"
    if plan.normal_map:
        u, v = plan.normal_span
        # A division by two is exact, and so is the level of detail.
        uv = at.uv if (u, v) == (1, 1) else f"{at.uv} / vec2({u}.0, {v}.0)"
        sample = f"texture(u_normal_map, {uv}).xyz"
        frame = f"mapped_frame({at.normal}, {at.tangent}, side, {sample}, u_normal_scale)"
    elif plan.tangents:
        frame = f"tangent_frame({at.normal}, {at.tangent}, side)"
    else:
        normal = f"unit({at.normal})" if plan.normalise else at.normal
        frame = f"Frame(side * {normal}, vec3(0.0), vec3(0.0))"
    if plan.direction_map:
        frame = f"turned_frame({frame}, mapped_direction(texture(u_direction_map, {at.uv}).rg))"
    if plan.turned:
        frame = f"turned_frame({frame}, u_turn)"
    return text + f"    return {frame};\n}}\n"


def _declared_lights(group: LightGroup) -> str:
    """The uniforms of a group. Counted lights have one for each field, so that what nobody reads is not there."""
    struct = LIGHTS.class_name(group.type)
    if not group.count:
        page = f"layout(std140) uniform {group.key}_page {{\n    {struct} u_{group.key}[{PAGE}];\n}};\n"
        return page + f"uniform int u_{group.key}_count;\n"
    array = "" if group.count == 1 else f"[{group.count}]"
    return "".join(
        f"uniform {'float' if name == 'intensity' and group.white else kind} u_{group.key}_{name}{array};\n"
        for name, kind in LIGHTS[group.type].fields().items()
        if name != "r_min" or group.falloff != "none"
    )


def _light(group: LightGroup) -> str:
    """The expression of one light's struct."""
    if not group.count:
        return f"u_{group.key}[i]"
    index = "" if group.count == 1 else "[i]"
    values = []
    for name in LIGHTS[group.type].fields():
        value = f"u_{group.key}_{name}{index}"
        if name == "r_min" and group.falloff == "none":
            value = "0.0"
        values.append(f"vec3({value})" if name == "intensity" and group.white else value)
    return f"{LIGHTS.class_name(group.type)}({', '.join(values)})"


def _loop(group: LightGroup) -> str:
    """c += what the lights of a group add."""
    struct = LIGHTS.class_name(group.type)
    inner = [f"{struct} light = {_light(group)};", "vec3 l;", "vec3 e = illuminate(light, p, l);"]
    if group.falloff != "none":
        inner.append(f"e *= falloff_{FALLOFFS[group.falloff]}(light.position - p, light.r_min);")
    inner.append("c += e * brdf_cos(m, f, l, v);")
    body = "".join(f"        {line}\n" for line in inner)
    head = "" if group.count == 1 else f"for (int i = 0; i < {group.count or f'u_{group.key}_count'}; ++i) "
    return f"    {head}{{\n{body}    }}\n"


# falloff -> its file under falloff/, and the end of its function's name.
FALLOFFS = {"1/r": "inverse", "1/r^2": "inverse_square"}


def _shading(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> str:
    """Everything up to `vec3 radiance(float side)`: what the surface shows to the viewer, linear."""
    text = at.declarations
    if plan.shows != "light":
        return text + _shown(plan, at)
    struct = BRDFS.class_name(plan.brdf)
    ambient, shine = "vec3(0.0)", ""
    if plan.ambient == "constant":
        text += "uniform vec3 u_ambient_radiance;\n"
        ambient = "u_ambient_radiance"
    if plan.ambient == "varying":
        text += '#include "light/ambient.glsl"\nuniform vec3 u_ambient_intensity;\n'
        ambient = "illuminate(AmbientLight(u_ambient_intensity)) * ambient_reflectance(m)"
    if plan.directed or plan.ambient == "varying":
        text += _material(plan, at)
        shine = f"    {struct} m = material();\n"
    if not plan.directed:
        # Where nothing shines at all, the surface is black, and keeps its place in the picture.
        return text + f"\nvec3 radiance(float side) {{\n{shine}    return {ambient};\n}}\n"
    text += _frame(plan, at) + f'#include "viewer/{plan.viewer}.glsl"\n#include "lib/horizon.glsl"\n'
    for group in plan.lights:
        text += f'#include "light/{group.type}.glsl"\n'
        if group.falloff != "none":
            text += f'#include "falloff/{FALLOFFS[group.falloff]}.glsl"\n'
        text += _declared_lights(group)
    position = at.position if plan.positions else "vec3(0.0)"
    text += f"\nvec3 radiance(float side) {{\n{shine}    Frame f = frame(side);\n"
    text += f"    vec3 p = {position};\n    vec3 v = above_horizon(viewer(p), f.n);\n    vec3 c = {ambient};\n"
    text += "".join(map(_loop, plan.lights)) + "    return c;\n}\n"
    return text + _faces_viewer(plan, at)


def _faces_viewer(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> str:
    """`bool faces_viewer()`, which a face asks that is seen from both sides."""
    if plan.rate != "flat" or not plan.both_sides:
        return ""
    position = at.position if plan.positions else "vec3(0.0)"
    return f"\nbool faces_viewer() {{\n    return dot({at.normal}, viewer({position})) >= 0.0;\n}}\n"


def _shown(plan: ProgramPlan, at: _Interpolated | _AtVertex) -> str:
    """`vec3 radiance(float side)` of what is shown in place of light."""
    text = ""
    if plan.shows == "normal":
        text = _frame(plan, at) + f'#include "viewer/{plan.viewer}.glsl"\n' * (plan.rate == "flat" and plan.both_sides)
        value = "frame(side).n"
    elif plan.shows == "uv":
        value = f"vec3({at.uv}, 0.0)"
    else:
        text, value = "uniform vec3 u_viewer;\nuniform float u_number;\n", f"vec3(-dot(u_viewer, {at.position}), u_number, 0.0)"
    return text + f"\nvec3 radiance(float side) {{\n    return {value};\n}}\n" + _faces_viewer(plan, at)


def _alpha_inputs(plan: ProgramPlan, direction: str) -> str:
    """What the fragment stage of a per-vertex or per-face program asks of the vertex stage beside its colour."""
    names = _wanted_by_alpha(plan)
    text = "".join(f"{_varying(name, direction)}\n" for name in names)
    if direction == "in":
        return text
    declared = () if plan.rate == "flat" else _wanted(plan)
    attributes = "".join(f"in {TYPES[name]} a_{name};\n" for name in names if name not in declared)
    body = "".join(f"    v_{name} = a_{name};\n" for name in names)
    return attributes + text + f"\nvoid interpolate() {{\n{body}}}\n"


def _alpha(plan: ProgramPlan) -> str:
    """`float alpha()`: opacity; a cut-out discards."""
    if plan.alpha == "opaque":
        return "\nfloat alpha() {\n    return 1.0;\n}\n"
    text, value = "uniform float u_alpha;\n", "u_alpha"
    if plan.alpha_from:
        if plan.rate != "phong" or not bound_for_shading(plan, plan.alpha_from):
            text += f"uniform sampler2D u_{plan.alpha_from}_texture;\n"
        value += f" * texture(u_{plan.alpha_from}_texture, v_uv).a"
    if plan.vertex_colours:
        value += " * v_colour.a"
    if plan.alpha == "blend":
        return text + f"\nfloat alpha() {{\n    return {value};\n}}\n"
    text += "uniform float u_alpha_cutoff;\n"
    return text + f"\nfloat alpha() {{\n    if ({value} < u_alpha_cutoff)\n        discard;\n    return 1.0;\n}}\n"
