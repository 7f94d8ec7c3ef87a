"""Program: messages of all drivers name file, line and column, and uniforms and attributes are set and described."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import pytest

from glshade import Renderer, ShaderError
from glshade.gl.context import Context
from glshade.gl.driver_log import messages, problem
from glshade.gl.program import TYPES, Program
from glshade.glsl.source import Source, Stage

STAGE = Stage("a\nb\nc\nd\n", (("x.glsl", 1), ("y.glsl", 7), ("y.glsl", 8), ("<surface>", 3)))


@pytest.mark.parametrize(
    ("log", "expected"),
    [
        ("0:2(5): error: `foo' undeclared", ["y.glsl:7:5: error: `foo' undeclared"]),
        ("0:4(1): warning: unused", ["<surface>:3:1: warning: unused"]),
        ('0(3) : error C1503: undefined variable "foo"', ['y.glsl:8: error C1503: undefined variable "foo"']),
        ("0(3) : warning C7050: might be used", ["y.glsl:8: warning C7050: might be used"]),
        ("ERROR: 0:1: Use of undeclared identifier 'foo'", ["x.glsl:1: Use of undeclared identifier 'foo'"]),
        ("WARNING: 0:2: extension is not supported", ["y.glsl:7: warning: extension is not supported"]),
        (
            "0:99(1): error: syntax error, unexpected end of file",
            ["<surface>:3:1: error: syntax error, unexpected end of file"],
        ),
        (
            "GLSL Compiler failed\n\nfragment_shader\n===============\n0:2(5): error: one\n0:3(6): error: two\n\n",
            ["y.glsl:7:5: error: one", "y.glsl:8:6: error: two"],
        ),
        ("error: vertex shader output `v' has no match", ["error: vertex shader output `v' has no match"]),
        ("", []),
    ],
)
def test_messages(log: str, expected: list[str]) -> None:
    assert [str(problem(message, STAGE, "fragment")) for message in messages(log)] == expected


def stage(text: str, name: str) -> Stage:
    return Stage(text, tuple((name, number) for number, _ in enumerate(text.splitlines(), 1)))


VERTEX = """#version 330 core
in vec3 a_p;
uniform mat4 u_b_from_a;
void main() {
    gl_Position = u_b_from_a * vec4(a_p, 1.0);
}
"""
FRAGMENT = """#version 330 core
uniform float u_x;
uniform float u_none;
out vec4 o;
void main() {
    o = vec4(u_x);
}
"""


@pytest.fixture
def context(renderer: Renderer) -> Iterator[Context]:
    """The renderer's context, made current."""
    with renderer.context.gl:
        yield renderer.context


def test_the_stage_at_fault_is_named(context: Context) -> None:
    with pytest.raises(ShaderError, match=r"^f\.frag:6:\d+: .*u_y"):
        Program(context, Source(stage(VERTEX, "v.vert"), stage(FRAGMENT.replace("vec4(u_x)", "vec4(u_y)"), "f.frag")))
    with pytest.raises(ShaderError, match=r"^v\.vert:5:\d+: .*a_q"):
        Program(context, Source(stage(VERTEX.replace("vec4(a_p", "vec4(a_q"), "v.vert"), stage(FRAGMENT, "f.frag")))


def test_stages_that_do_not_fit(context: Context) -> None:
    vertex = VERTEX.replace("void main() {", "out vec3 v_x;\nvoid main() {\n    v_x = a_p;")
    fragment = FRAGMENT.replace("out vec4 o;", "in vec4 v_x;\nout vec4 o;").replace("vec4(u_x)", "v_x * u_x")
    with pytest.raises(ShaderError, match="v_x") as caught:
        Program(context, Source(stage(vertex, "v.vert"), stage(fragment, "f.frag")))
    assert "==" not in str(caught.value)


def test_uniforms_and_attributes(context: Context) -> None:
    program = Program(context, Source(stage(VERTEX, "v.vert"), stage(FRAGMENT, "f.frag")))
    assert set(program.uniforms) == {"u_b_from_a", "u_x"}, "what the driver dropped is not there"
    assert program.attributes == ("a_p",)
    matrix = np.arange(16, dtype=np.float32).reshape(4, 4)
    program.write("u_b_from_a", matrix)
    program.write("u_x", np.float32(0.5))
    program.write("u_none", np.float32(1))
    # GL stores matrices by columns, NumPy by rows.
    assert np.frombuffer(program.members["u_b_from_a"].read(), dtype=np.float32).reshape(4, 4).T.tolist() == matrix.tolist()
    assert program.members["u_x"].value == 0.5


TYPED_VERTEX = """#version 330 core
in vec2 a_p;
in ivec3 a_i;
in float a_unused;
struct Lamp { vec3 l; float power[2]; };
uniform Lamp u_lamps[2];
uniform mat2x3 u_m;
uniform uint u_n;
uniform bool u_on;
layout(std140) uniform page { Lamp u_many[8]; };
out vec3 v_c;
void main() {
    v_c = u_lamps[0].l * u_lamps[1].power[1] + u_m * a_p + u_many[a_i.x].l * float(u_n);
    gl_Position = vec4(a_p, u_on ? float(a_i.z) : u_many[a_i.y].power[0], 1.0);
}
"""
TYPED_FRAGMENT = """#version 330 core
in vec3 v_c;
uniform sampler2D u_t[2];
uniform samplerCube u_cube;
uniform float u_weights[3];
uniform vec4 u_dropped;
out vec4 o;
void main() {
    o = texture(u_t[0], v_c.xy) + texture(u_t[1], v_c.yx) * u_weights[2] + texture(u_cube, v_c) * u_weights[0];
}
"""


def test_the_interface_has_glsl_types(context: Context) -> None:
    source = Source(stage(TYPED_VERTEX, "v.vert"), stage(TYPED_FRAGMENT, "f.frag"))
    # The second program comes from the disk cache, if the driver offers binaries.
    for program in (Program(context, source), Program(context, source)):
        interface = json.loads(json.dumps(program.interface))
        assert interface["attributes"] == {"a_p": "vec2", "a_i": "ivec3"}
        # Some drivers drop the unused members of a structure, others keep all of them.
        lamps = {name: type for name, type in interface["uniforms"].items() if name.startswith("u_lamps")}
        assert lamps.items() >= {"u_lamps[0].l": "vec3", "u_lamps[1].power": "float[2]"}.items()
        assert {name: type for name, type in interface["uniforms"].items() if name not in lamps} == {
            "u_m": "mat2x3",
            "u_n": "uint",
            "u_on": "bool",
            "u_t": "sampler2D[2]",
            "u_cube": "samplerCube",
            "u_weights": "float[3]",
        }
        # In std140 a Lamp takes 48 bytes: a vec3 and two floats, each padded to 16 bytes.
        assert interface["blocks"] == {"page": 8 * 48}


def test_the_types_are_those_of_the_registry(context: Context) -> None:
    """A program with a uniform of each type in TYPES reports that type."""
    for number, name in TYPES.items():
        sampler = "sampler" in name
        size = "vec3(0.5)" if name in ("sampler3D", "samplerCube", "sampler2DShadow", "sampler2DArray") else "vec2(0.5)"
        if sampler:
            use = f"vec4(texture(u_x, {size}))"
        elif name.startswith("mat"):
            use = "vec4(u_x[0].x)"
        else:
            use = "vec4(u_x)" if name in ("int", "uint", "float", "bool") else "vec4(u_x.x)"
        text = f"#version 330 core\nuniform {name} u_x;\nout vec4 o;\nvoid main() {{\n    o = {use};\n}}\n"
        vertex = "#version 330 core\nvoid main() {\n    gl_Position = vec4(0.0);\n}\n"
        program = Program(context, Source(stage(vertex, "v.vert"), stage(text, "f.frag")))
        assert program.interface["uniforms"] == {"u_x": name}, hex(number)
