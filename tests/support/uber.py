"""An uber shader: one program with every model, lobe, option, type of light, texture and map, each behind a switch.

Without a generator of specialised programs, a renderer would use such a program. Tests compare the pictures of specialised
programs with those of the uber shader, whose speed shows how much time specialisation saves.

`python tests/support/uber.py [FILE]` times specialised programs and the uber shader, and writes the figures to FILE as JSON if
one is given.
"""

from __future__ import annotations

import itertools
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any, get_args

import moderngl
import numpy as np

from glshade import BRDFS, Renderer, Scene
from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.assembly.values import ambient_intensity, light_values
from glshade.brdfs import Brdf
from glshade.gl.preparation import DrawCall, Encoding, Prepared
from glshade.glsl.definitions import find_definitions
from glshade.glsl.generator import slot_code
from glshade.glsl.plan import ProgramPlan
from glshade.glsl.shaders import expand
from glshade.glsl.source import Code, Source
from glshade.glsl.uniforms import object_uniforms, parameter_values, textures
from glshade.lights import FALLOFFS, LIGHTS
from glshade.mesh.mesh import Mesh
from glshade.mesh.tangents import with_tangents
from glshade.textures.texels import texels_of
from glshade.textures.texture import Texture
from glshade.textures.volume import Volume

# The largest number of lights of one type.
LIGHTS_OF_A_KIND = 8
DIRECTED = tuple(name for name, model in LIGHTS.items() if not model.omnidirectional)
Names = tuple[str, ...]
UNIFORMS = {
    "int": (
        *("u_model", "u_base", "u_textured", "u_perspective", "u_both_sides", "u_vertex_colours", "u_normal_mapped"),
        *("u_turned", "u_direction_mapped", "u_alpha_mode", "u_ambient"),
    ),
    "float": ("u_normal_scale", "u_alpha", "u_alpha_cutoff"),
    "vec2": ("u_normal_span", "u_turn"),
    "vec3": ("u_viewer", "u_ambient_intensity"),
    "sampler2D": ("u_normal_map", "u_direction_map"),
}
# The samplers of the models' tables.
TABLES = {f"u_{table}" for model in BRDFS.values() for table in model.tables}
# The names that stay as they are: the struct Frame, two functions that GLSL overloads by the type of the model's struct, and
# the samplers of tables.
SHARED = {"Frame", "brdf_cos", "ambient_reflectance"} | TABLES


@cache
def cases() -> dict[tuple[str, tuple[str, ...]], int]:
    """Returns the number of the case in the switch for each model with each combination of its options."""
    found = [
        (name, options)
        for name, model in BRDFS.items()
        for options in itertools.product(*(get_args(model.model_fields[key].annotation) for key in model.choices()))
    ]
    return {case: number for number, case in enumerate(found)}


def full(name: str, options: tuple[str, ...]) -> Brdf:
    """Returns a material of the model that has every lobe and uses the tangents."""
    model = BRDFS[name]
    values: dict[str, Any] = dict(zip(model.choices(), options, strict=True))
    for index, (key, declared) in enumerate(model.parameters().items()):
        # The middle of the usual range, with an offset that differs between parameters.
        value = 0.5 * sum(declared.usual) + 1e-3 * (index + 1)
        values[key] = (value,) * 3 if model.is_colour(key) else value
    return model.model_validate(values)


def struct(name: str, number: int) -> str:
    return f"{BRDFS.class_name(name)}_{number}"


def arguments(name: str) -> Iterator[str]:
    """Yields the arguments of the constructor of the struct: elements of `colours` and `numbers`, as declared."""
    colours, numbers = itertools.count(), itertools.count()
    model = BRDFS[name]
    for key in model.parameters():
        yield f"colours[{next(colours)}]" if model.is_colour(key) else f"numbers[{next(numbers)}]"


def places(name: str) -> dict[str, tuple[str, int]]:
    """Returns, for each parameter, the name of the array that holds it and its index in that array."""
    found = (re.fullmatch(r"(\w+)\[(\d+)\]", argument) for argument in arguments(name))
    return {key: (match[1], int(match[2])) for key, match in zip(BRDFS[name].parameters(), found, strict=True) if match}


@cache
def sizes() -> dict[str, int]:
    """Returns the lengths of the arrays `colours` and `numbers`."""
    every = [place for name in BRDFS for place in places(name).values()]
    return {array: max(index for kind, index in every if kind == array) + 1 for array in ("colours", "numbers")}


def model_text(name: str, options: tuple[str, ...], number: int) -> str:
    """Returns the text of the model's file with its includes. The number is appended to every name, so that none clash."""
    lines = expand(f"brdf/{name}.glsl", slot_code(full(name, options).slots())).text.splitlines()
    found = find_definitions(lines)
    frame = {i for one in found if one.name == "Frame" for i in range(one.first, one.end)}
    text = "\n".join(line for i, line in enumerate(lines) if i not in frame)
    for own in {one.name for one in found} - SHARED:
        text = re.sub(rf"\b{own}\b", f"{own}_{number}", text)
    return text + "\n"


def switch(names: Names, value: str, others: str) -> str:
    """Returns the body of a function that calls `value` for the model u_model, by a switch with a case for each name."""
    body = ""
    for (name, _), number in cases().items():
        if name in names:
            material = f"{struct(name, number)}({', '.join(arguments(name))})"
            body += f"    case {number}:\n        c = {value}({material}{others});\n        break;\n"
    return f"    vec3 c = vec3(0.0);\n    switch (u_model) {{\n{body}    }}\n    return c;\n"


def falls_off(light: str) -> bool:
    return "falloff" in LIGHTS[light].model_fields


def every_light() -> str:
    """Returns statements that set l and e from light number i, which counts through all lights, type by type."""
    text = ""
    for previous, name in zip((None, *DIRECTED), DIRECTED, strict=False):
        number = f"(i -= u_{previous}_count)" if previous else "i"
        strength = f"illuminate(u_{name}[i], p, l)"
        if falls_off(name):
            strength += f" * every_falloff(u_{name}_falloff[i], u_{name}[i].position - p, u_{name}[i].r_min)"
        text += f"        if ({number} < u_{name}_count)\n            e = {strength};\n        else\n"
    return text + "            break;\n"


def fragment(names: Names) -> Code:
    """Returns the slot `surface` of pass/phong_both.frag, with the models of these names."""
    colours, numbers = sizes()["colours"], sizes()["numbers"]
    surface = ("frame", "tangent_frame", "turned_frame", "normal_map", "direction_map", "horizon")
    code = Code().include(*(f"surface/{name}.glsl" for name in surface), "math/unit.glsl")
    code.include(*(f"light/{name}.glsl" for name in LIGHTS))
    code.include(*(f"falloff/{law.name}.glsl" for law in FALLOFFS.values() if law.power))
    for type_, name in (("vec3", "position"), ("vec3", "normal"), ("vec4", "tangent"), ("vec2", "uv"), ("vec4", "colour")):
        code.input(type_, f"v_{name}")
    code.uniform("vec3", "u_colours", colours).uniform("float", "u_numbers", numbers)
    for i in range(colours):
        code.uniform("sampler2D", f"u_colour_texture_{i}")
    for type_, those in UNIFORMS.items():
        for name in those:
            code.uniform(type_, name)
    for name in DIRECTED:
        code.uniform(LIGHTS.class_name(name), f"u_{name}", LIGHTS_OF_A_KIND).uniform("int", f"u_{name}_count")
        if falls_off(name):
            code.uniform("int", f"u_{name}_falloff", LIGHTS_OF_A_KIND)
    text = "".join(model_text(*case, number) for case, number in cases().items() if case[0] in names)
    parameters = f"vec3 colours[{colours}], float numbers[{numbers}]"
    text += f"vec3 every_brdf_cos({parameters}, Frame f, vec3 l, vec3 v) {{\n{switch(names, 'brdf_cos', ', f, l, v')}}}\n"
    text += f"vec3 every_ambient({parameters}) {{\n{switch(names, 'ambient_reflectance', '')}}}\n"
    textures = "".join(
        f"    if ((u_textured & {1 << i}) != 0)\n        colours[{i}] *= texture(u_colour_texture_{i}, v_uv).rgb;\n"
        for i in range(colours)
    )
    return code.add(
        text
        + f"""
float every_falloff(int kind, vec3 to_light, float r_min) {{
    return kind == 0 ? 1.0 : kind == 1 ? falloff_inverse(to_light, r_min) : falloff_inverse_square(to_light, r_min);
}}

vec3 radiance(float side) {{
    if (u_both_sides == 0)
        side = 1.0;
    vec3 colours[{colours}] = u_colours;
    float numbers[{numbers}] = u_numbers;
{textures}    if (u_vertex_colours != 0 && u_base >= 0)
        colours[0] *= v_colour.rgb;
    Frame f;
    if (u_normal_mapped != 0)
        f = mapped_frame(v_normal, v_tangent, side, texture(u_normal_map, v_uv / u_normal_span).xyz, u_normal_scale);
    else
        f = tangent_frame(v_normal, v_tangent, side);
    if (u_direction_mapped != 0)
        f = turned_frame(f, mapped_direction(texture(u_direction_map, v_uv).rg));
    if (u_turned != 0)
        f = turned_frame(f, u_turn);
    vec3 p = v_position;
    vec3 v = above_horizon(u_perspective != 0 ? unit(-p) : u_viewer, f.n);
    vec3 c = vec3(0.0);
    if (u_ambient != 0)
        c = u_ambient_intensity * every_ambient(colours, numbers);
    int all = {" + ".join(f"u_{name}_count" for name in DIRECTED)};
    for (int k = 0; k < all; ++k) {{
        int i = k;
        vec3 l;
        vec3 e;
{every_light()}        c += e * every_brdf_cos(colours, numbers, f, l, v);
    }}
    return c;
}}

float alpha() {{
    float a = u_alpha;
    if (u_base >= 0 && (u_textured & 1) != 0)
        a *= texture(u_colour_texture_0, v_uv).a;
    if (u_vertex_colours != 0)
        a *= v_colour.a;
    if (u_alpha_mode == 1 && a < u_alpha_cutoff)
        discard;
    return u_alpha_mode == 2 ? a : 1.0;
}}
"""
    )


@cache
def everything(names: Names = tuple(BRDFS)) -> Source:
    """Returns the program with the models of these names. It evaluates per pixel and writes linear light."""
    vertex = Code().output("vec3", "v_position")
    for name, type_ in {"normal": "vec3", "tangent": "vec4", "uv": "vec2", "colour": "vec4"}.items():
        vertex.input(type_, f"a_{name}").output(type_, f"v_{name}")
    vertex.include("surface/normal_transform.glsl", "surface/tangent_transform.glsl")
    vertex.add("void interpolate() {\n    v_position = world(a_position);\n    v_normal = world_normal(a_normal);\n")
    vertex.add("    v_tangent = world_tangent(a_tangent);\n    v_uv = a_uv;\n    v_colour = a_colour;\n}\n")
    output = Code().include("output/linear.glsl")
    return Source(
        expand("pass/phong.vert", {"surface": vertex}),
        expand("pass/phong_both.frag", {"surface": fragment(names), "output": output}),
    )


class EverythingRenderer(Renderer):
    """Draws every scene with the uber shader: per pixel, in float32, and with at most eight lights of a type.

    names: the models that the program holds.
    """

    names: Names = tuple(BRDFS)

    def __enter__(self) -> EverythingRenderer:
        return self

    def prepare(self, scene: Scene, shading: Any, encoding: Encoding, part: Any = None) -> Prepared:
        made = super().prepare(scene, shading, encoding, part)
        exposure = scene.film.exposure
        drawn = [(one.plan, instance) for one in made.calls for instance in one.instances]
        return replace(made, calls=[self.call(plan, instance, made.assembly, exposure) for plan, instance in drawn])

    def call(self, plan: ProgramPlan, instance: Instance, assembly: Assembly, exposure: float) -> DrawCall:
        """Returns the draw call of an instance with the uber shader."""
        assert plan.rate == "phong"
        assert plan.encoding == "linear"
        program = self.resources.program(everything(self.names))
        material = instance.material
        model = type(material)
        where = places(material.brdf)
        arrays = {"colours": np.zeros((sizes()["colours"], 3)), "numbers": np.zeros(sizes()["numbers"])}
        declared = model.parameters()
        textured, samplers = 0, []
        for key, value in parameter_values(material).items():
            array, index = where[key]
            given = declared[key].same_as or key if getattr(material, key) is None else key
            if isinstance(value, Texture):
                assert array == "colours", "only colours have textures here"
                textured |= 1 << index
                samplers.append((f"u_colour_texture_{index}", self.resources.texture(texels_of(material, given))))
            arrays[array][index] = value.factor if isinstance(value, Texture) else value
        # Vertex colours multiply the first colour.
        base = next((where[key][1] for key, parameter in declared.items() if parameter.base), -1)
        assert base in (-1, 0)
        values: dict[str, Any] = {
            **object_uniforms(replace(plan, anisotropic=True, lights=plan.lights or FULL), instance, assembly.view.eye),
            **{"u_colours": arrays["colours"], "u_numbers": arrays["numbers"]},
            **{"u_ambient_intensity": ambient_intensity(assembly, instance.lights, exposure)},
            **{"u_normal_span": plan.normal_span, "u_alpha": material.alpha, "u_alpha_cutoff": material.alpha_cutoff},
        }
        integers = {
            "u_model": cases()[material.brdf, tuple(material.chosen().values())],
            **{"u_base": base, "u_textured": textured, "u_perspective": plan.viewer != "orthographic"},
            **{"u_both_sides": plan.both_sides, "u_vertex_colours": plan.vertex_colours, "u_turned": plan.turned},
            **{"u_normal_mapped": plan.normal_map, "u_direction_mapped": plan.direction_map},
            **{"u_alpha_mode": ("opaque", "mask", "blend").index(plan.alpha), "u_ambient": plan.ambient != "none"},
        }
        for kind in DIRECTED:
            chosen = [light for light in (assembly.lights[i] for i in instance.lights) if light.type == kind and plan.directed]
            assert len(chosen) <= LIGHTS_OF_A_KIND
            integers[f"u_{kind}_count"] = len(chosen)
            for index, light in enumerate(chosen):
                numbers = light_values(light, assembly.view.eye, exposure)
                values |= {f"u_{kind}[{index}].{name}": value for name, value in numbers.items()}
            falloffs = [list(FALLOFFS).index(getattr(light, "falloff", "none")) for light in chosen]
            values[f"u_{kind}_falloff"] = np.array((*falloffs, *[0] * LIGHTS_OF_A_KIND)[:LIGHTS_OF_A_KIND], dtype=np.int32)
        values |= {name: np.int32(value) for name, value in integers.items()}
        maps = {"u_normal_map": plan.normal_map, "u_direction_map": plan.direction_map}
        samplers += [
            (name, self.resources.texture(wanted))
            for name, wanted in textures(plan, material).items()
            if maps.get(name) or name in TABLES
        ]
        named = dict(samplers)
        # Unused samplers share a texture, because two types of sampler must not refer to one texture unit.
        unused = [name for name in program.uniforms if "texture_" in name or name in maps if name not in named]
        samplers += [(name, self.nothing) for name in unused]
        empty = Volume.constant(0.0)
        samplers += [(name, self.resources.texture(empty)) for name in TABLES & set(program.uniforms) - set(named)]
        written = {
            name: value if np.asarray(value).dtype == np.int32 else rounded(value)
            for name, value in values.items()
            if name in program.members
        }
        # A driver may shorten an array to the elements that the program reads.
        for name in ("u_colours", "u_numbers", *(f"u_{kind}_falloff" for kind in DIRECTED)):
            if name in written:
                written[name] = written[name][: program.members[name].array_length]
        vertices = self.resources.vertices.array(complete(instance.mesh), program)
        return DrawCall((instance,), instance.mirrored, plan, program, vertices, written, samplers, {}, [])

    @property
    def nothing(self) -> moderngl.Texture:
        """The texture for samplers that the material does not use."""
        if not hasattr(self, "_nothing"):
            self._nothing = self.context.gl.texture((1, 1), 4, np.ones(4, dtype=np.float32).tobytes(), dtype="f4")
        return self._nothing


# object_uniforms gives the matrices for normals and tangents only where a plan has a light.
FULL: Any = ("a light",)


@cache
def complete(mesh: Mesh) -> Mesh:
    """Returns the mesh with tangents and vertex colours, which are white if it has none."""
    if mesh.tangents is None:
        mesh = with_tangents(mesh)
    if mesh.colours is None:
        mesh = replace(mesh, colours=np.ones((len(mesh.positions), 4), dtype=np.float32))
    return mesh


def benchmark(repeat: int = 9) -> dict[str, Any]:
    """Returns the median times [ms] to draw a sphere of 20,000 triangles under one directional light at 1024 x 1024.

    The renderers are timed in turns. "alone" is a program with all lights, textures and maps, but only the one model. A
    software driver executes every case of a switch, hardware only one: on hardware the time of the whole uber shader is nearer
    to "alone".
    """
    found: dict[str, Any] = {}
    with Renderer() as special, EverythingRenderer() as every, EverythingRenderer() as alone:
        for name in ("lambert", "phong", "ggx"):
            alone.names = (name,)
            scene = Scene.model_validate(
                {
                    "objects": [{"shape": {"type": "sphere", "segments": 144, "rings": 71}, "material": {"brdf": name}}],
                    "lights": [{"type": "directional", "direction": [-0.4, -0.6, -0.7]}],
                    "film": {"size": [1024, 1024], "encoding": "linear"},
                }
            )
            renderers = {"specialised": special, "everything": every, "alone": alone}
            draws = {key: renderer.drawing(scene) for key, renderer in renderers.items()}
            times: dict[str, list[float]] = {key: [] for key in draws}
            for _ in range(repeat):
                for key, draw in draws.items():
                    times[key].append(1e3 * draw())
            found[name] = {key: {"median_ms": median(t), "low_ms": min(t), "high_ms": max(t)} for key, t in times.items()}
            for key in ("everything", "alone"):
                found[name][key]["times_slower"] = median(times[key]) / median(times["specialised"])
        found["renderer"] = special.context.renderer
    return found


def main() -> None:
    found = benchmark()
    if sys.argv[1:]:
        Path(sys.argv[1]).write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    for name, row in found.items():
        if isinstance(row, dict):
            print(f"{name:10} specialised {row['specialised']['median_ms']:8.2f} ms", end="")
            for key, words in (("everything", "everything"), ("alone", "everything, one model")):
                print(f"   {words} {row[key]['median_ms']:8.2f} ms, {row[key]['times_slower']:.1f} times as long", end="")
            print()


if __name__ == "__main__":
    main()
