"""One program that holds everything: every model with all its lobes and options, every kind of light, every texture and map,
each behind a switch. What a shader without a generator would be: an oracle for the programs that hold only what they need, and
the measure of what they save.

python tests/everything.py [FILE]: times specialised programs against it, and with FILE writes the figures as JSON.
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
from glshade.assembly.assembly import Assembly, Instance
from glshade.assembly.values import ambient_intensity, light_values
from glshade.brdfs import Brdf
from glshade.gl.renderer import Draw
from glshade.glsl.definitions import definitions
from glshade.glsl.generator import FALLOFFS, SHADERS, Source, expand
from glshade.glsl.plan import ProgramPlan
from glshade.glsl.uniforms import object_uniforms, parameter_values, textures
from glshade.lights import LIGHTS
from glshade.mesh.mesh import Mesh, with_tangents
from glshade.textures.texels import texels
from glshade.textures.texture import Texture

# Lights of one kind at most.
LIGHTS_OF_A_KIND = 8
DIRECTED = ("directional", "point", "spot")
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
# What all models share: one struct, and the names that the compiler tells apart by it.
SHARED = {"Frame", "brdf_cos", "ambient_reflectance"}


@cache
def cases() -> dict[tuple[str, tuple[str, ...]], int]:
    """(model, its options) -> the number of its case."""
    found = [
        (name, options)
        for name, model in BRDFS.items()
        for options in itertools.product(*(get_args(model.model_fields[key].annotation) for key in model.choices()))
    ]
    return {case: number for number, case in enumerate(found)}


def full(name: str, options: tuple[str, ...]) -> Brdf:
    """A material of the model that has every lobe and looks at the tangents."""
    model = BRDFS[name]
    values: dict[str, Any] = dict(zip(model.choices(), options, strict=True))
    for index, (key, declared) in enumerate(model.parameters().items()):
        # In the middle of its range, and no two alike.
        value = 0.5 * sum(declared.usual) + 1e-3 * (index + 1)
        values[key] = (value,) * 3 if model.is_colour(key) else value
    return model.model_validate(values)


def struct(name: str, number: int) -> str:
    return f"{BRDFS.class_name(name)}_{number}"


def arguments(name: str) -> Iterator[str]:
    """The struct's members: colours and numbers in turn, as they are declared."""
    colours, numbers = itertools.count(), itertools.count()
    model = BRDFS[name]
    for key in model.parameters():
        yield f"colours[{next(colours)}]" if model.is_colour(key) else f"numbers[{next(numbers)}]"


def places(name: str) -> dict[str, tuple[str, int]]:
    """parameter -> (the array it is in, its place there)."""
    found = (re.fullmatch(r"(\w+)\[(\d+)\]", argument) for argument in arguments(name))
    return {key: (match[1], int(match[2])) for key, match in zip(BRDFS[name].parameters(), found, strict=True) if match}


@cache
def sizes() -> dict[str, int]:
    """How long the two arrays are."""
    every = [place for name in BRDFS for place in places(name).values()]
    return {array: max(index for kind, index in every if kind == array) + 1 for array in ("colours", "numbers")}


def model_text(name: str, options: tuple[str, ...], number: int) -> str:
    """The model's file with all it includes, every name with its number, so that all models stand side by side."""
    lines = expand(f"brdf/{name}.glsl", full(name, options).slots()).text.splitlines()
    found = definitions(lines)
    frame = {i for one in found if one.name == "Frame" for i in range(one.first, one.end)}
    text = "\n".join(line for i, line in enumerate(lines) if i not in frame)
    for own in {one.name for one in found} - SHARED:
        text = re.sub(rf"\b{own}\b", f"{own}_{number}", text)
    return text + "\n"


def switch(names: Names, value: str, others: str) -> str:
    """A switch over the models whose every case sets c."""
    body = ""
    for (name, _), number in cases().items():
        if name in names:
            material = f"{struct(name, number)}({', '.join(arguments(name))})"
            body += f"    case {number}:\n        c = {value}({material}{others});\n        break;\n"
    return f"    vec3 c = vec3(0.0);\n    switch (u_model) {{\n{body}    }}\n    return c;\n"


def fragment(names: Names) -> str:
    """The surface of pass/phong_both.frag, with these models."""
    colours, numbers = sizes()["colours"], sizes()["numbers"]
    text = "".join(f'#include "{path.relative_to(SHADERS)}"\n' for path in sorted(SHADERS.glob("lib/*frame.glsl")))
    files = ("lib/normal_map", "lib/direction_map", "lib/horizon", "lib/unit", *(f"light/{name}" for name in LIGHTS))
    text += "".join(f'#include "{name}.glsl"\n' for name in (*files, *(f"falloff/{end}" for end in FALLOFFS.values())))
    text += "in vec3 v_position;\nin vec3 v_normal;\nin vec4 v_tangent;\nin vec2 v_uv;\nin vec4 v_colour;\n"
    text += f"uniform vec3 u_colours[{colours}];\nuniform float u_numbers[{numbers}];\n"
    text += "".join(f"uniform sampler2D u_colour_texture_{i};\n" for i in range(colours))
    text += "".join(f"uniform {type} {', '.join(those)};\n" for type, those in UNIFORMS.items())
    for name in DIRECTED:
        text += f"uniform {LIGHTS.class_name(name)} u_{name}[{LIGHTS_OF_A_KIND}];\nuniform int u_{name}_count;\n"
        text += f"uniform int u_{name}_falloff[{LIGHTS_OF_A_KIND}];\n" * (name != "directional")
    text += "".join(model_text(*case, number) for case, number in cases().items() if case[0] in names)
    parameters = f"vec3 colours[{colours}], float numbers[{numbers}]"
    text += f"vec3 every_brdf_cos({parameters}, Frame f, vec3 l, vec3 v) {{\n{switch(names, 'brdf_cos', ', f, l, v')}}}\n"
    text += f"vec3 every_ambient({parameters}) {{\n{switch(names, 'ambient_reflectance', '')}}}\n"
    textures = "".join(
        f"    if ((u_textured & {1 << i}) != 0)\n        colours[{i}] *= texture(u_colour_texture_{i}, v_uv).rgb;\n"
        for i in range(colours)
    )
    return (
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
    int all = u_directional_count + u_point_count + u_spot_count;
    for (int k = 0; k < all; ++k) {{
        int i = k;
        vec3 l;
        vec3 e;
        if (i < u_directional_count) {{
            e = illuminate(u_directional[i], p, l);
        }} else if ((i -= u_directional_count) < u_point_count) {{
            e = illuminate(u_point[i], p, l) * every_falloff(u_point_falloff[i], u_point[i].position - p, u_point[i].r_min);
        }} else {{
            i -= u_point_count;
            e = illuminate(u_spot[i], p, l) * every_falloff(u_spot_falloff[i], u_spot[i].position - p, u_spot[i].r_min);
        }}
        c += e * every_brdf_cos(colours, numbers, f, l, v);
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
    """The program, of all models or of these. It draws per pixel, in linear light."""
    attributes = {"normal": "vec3", "tangent": "vec4", "uv": "vec2", "colour": "vec4"}
    text = (
        "".join(f"in {type} a_{name};\nout {type} v_{name};\n" for name, type in attributes.items()) + "out vec3 v_position;\n"
    )
    text += '#include "lib/normal_transform.glsl"\n#include "lib/tangent_transform.glsl"\n'
    text += "void interpolate() {\n    v_position = world(a_position);\n    v_normal = world_normal(a_normal);\n"
    text += "    v_tangent = world_tangent(a_tangent);\n    v_uv = a_uv;\n    v_colour = a_colour;\n}\n"
    output = '#include "output/linear.glsl"\n'
    return Source(
        expand("pass/phong.vert", {"surface": text}),
        expand("pass/phong_both.frag", {"surface": fragment(names), "output": output}),
    )


class EverythingRenderer(Renderer):
    """Draws all there is with that one program: per pixel, in float32, and with eight lights of a kind at most.

    names: the models that are in it.
    """

    names: Names = tuple(BRDFS)

    def __enter__(self) -> EverythingRenderer:
        return self

    def _draw(
        self, plan: ProgramPlan, instance: Instance, assembly: Assembly, exposure: float, flat: bool, lights: Any, pages: Any
    ) -> Iterator[Draw]:
        assert plan.rate == "phong"
        assert plan.encoding == "linear"
        program = self._program(everything(self.names))
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
                samplers.append((f"u_colour_texture_{index}", self._texture(texels(material, given))))
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
            falloffs = [("none", *FALLOFFS).index(getattr(light, "falloff", "none")) for light in chosen]
            values[f"u_{kind}_falloff"] = np.array((*falloffs, *[0] * LIGHTS_OF_A_KIND)[:LIGHTS_OF_A_KIND], dtype=np.int32)
        values |= {name: np.int32(value) for name, value in integers.items()}
        maps = {"u_normal_map": plan.normal_map, "u_direction_map": plan.direction_map}
        samplers += [(name, self._texture(wanted)) for name, wanted in textures(plan, material).items() if maps.get(name)]
        named = dict(samplers)
        # Samplers of no use share a texture, lest two kinds of them stand on one unit.
        unused = [name for name in program.uniforms if "texture_" in name or name in maps if name not in named]
        samplers += [(name, self.nothing) for name in unused]
        written = {
            name: value if np.asarray(value).dtype == np.int32 else rounded(value)
            for name, value in values.items()
            if name in program.members
        }
        # Drivers cut off what nobody reads of an array.
        for name in ("u_colours", "u_numbers", *(f"u_{kind}_falloff" for kind in DIRECTED)):
            if name in written:
                written[name] = written[name][: program.members[name].array_length]
        yield Draw(instance, plan, program, self._vertices.array(complete(instance.mesh), program), written, samplers, {}, [])

    @property
    def nothing(self) -> moderngl.Texture:
        """A texture that nobody looks at."""
        if not hasattr(self, "_nothing"):
            self._nothing = self.context.gl.texture((1, 1), 4, np.ones(4, dtype=np.float32).tobytes(), dtype="f4")
        return self._nothing


# A light, so that normals and tangents are among an object's uniforms.
FULL: Any = ("a light",)


@cache
def complete(mesh: Mesh) -> Mesh:
    """The mesh with every attribute."""
    if mesh.tangents is None:
        mesh = with_tangents(mesh)
    if mesh.colours is None:
        mesh = replace(mesh, colours=np.ones((len(mesh.positions), 4), dtype=np.float32))
    return mesh


def benchmark(repeat: int = 9) -> dict[str, Any]:
    """Medians [ms] of a sphere of 20,000 triangles under one directional light at 1024 x 1024, taking turns.

    alone: by a program with all lights, textures and maps, but only that one model. A software driver goes through every case
    of a switch, hardware through one: there the truth is nearer to this.
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
