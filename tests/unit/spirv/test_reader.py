"""Reading of SPIR-V: damaged modules end in one clear line, and what a module says is read."""

from __future__ import annotations

import struct
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.texts import needs_compiler, stage_of

from glshade.errors import ShaderError
from glshade.spirv.compiler import _binary, compiled
from glshade.spirv.machine import run
from glshade.spirv.reader import read

pytestmark = needs_compiler

TEXT = """#version 330 core
struct Lamp { vec3 place; float power; };
layout(std140) uniform Lamps { Lamp u_lamps[4]; };
uniform mat3 u_m;
in vec3 v_position;
out vec4 o_colour;

vec3 lit(Lamp lamp) {
    vec3 d = lamp.place - v_position;
    return vec3(lamp.power / max(dot(d, d), 1e-6));
}

void main() {
    vec3 c = vec3(0.0);
    for (int i = 0; i < 4; i++)
        c += lit(u_lamps[i]);
    if (c.x < 0.01)
        discard;
    o_colour = vec4(u_m * c, 1.0);
}
"""
INPUTS = {
    "Lamps": {"u_lamps": [{"place": (0.0, 0.0, float(i)), "power": 1.0} for i in range(4)]},
    "u_m": np.eye(3),
    "v_position": np.ones((3, 3)),
}


@cache
def binary() -> bytes:
    return _binary(TEXT, "fragment")[0]


def test_what_is_read() -> None:
    module = read(binary())
    assert module.stage == "fragment"
    assert {variable.name: str(variable.type) for variable in module.variables} == {
        "Lamps": "Lamps",
        "u_m": "mat3",
        "v_position": "vec3",
        "o_colour": "vec4",
    }
    (lamps,) = module.variable("Lamps").type.members  # type: ignore[union-attr]
    assert (lamps.kind, lamps.count, lamps.element.names) == ("array", 4, ("place", "power"))  # type: ignore[union-attr]
    lines = {step.line for function in module.functions.values() for step in function.instructions}
    assert {9, 10, 14, 16, 17, 19} <= lines
    outputs = run(module, INPUTS, 3).outputs
    squares = np.array([2 + (i - 1.0) ** 2 for i in range(4)])
    np.testing.assert_allclose(outputs["o_colour"][:, :3], (1 / squares).sum(), rtol=1e-6)


def message(error: BaseException) -> str:
    """Returns the message of an error, which must be one line."""
    text = str(error)
    assert text
    assert "\n" not in text
    return text


@settings(max_examples=200, deadline=None)
@given(end=st.integers(0, 4000))
def test_truncated(end: int) -> None:
    cut = binary()[: end % len(binary())]
    with pytest.raises(ShaderError) as caught:
        read(cut)
    message(caught.value)


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_changed_words(data: st.DataObject) -> None:
    words = list(struct.unpack(f"<{len(binary()) // 4}I", binary()))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(5, len(words) - 1))
        words[at] = data.draw(st.one_of(st.integers(0, 400), st.integers(0, 2**32 - 1)))
    try:
        run(read(struct.pack(f"<{len(words)}I", *words)), INPUTS, 3)
    except ShaderError as error:
        message(error)


def test_text_that_does_not_compile() -> None:
    with pytest.raises(ShaderError, match=r"^stage.glsl:3: 'y' : undeclared identifier \(glslangValidator\)$"):
        compiled(stage_of("#version 330 core\nvoid main() {\n    float x = y;\n}\n"), "vertex")


def test_loop_that_does_not_end() -> None:
    module = read(
        _binary("#version 330 core\nout float o;\nvoid main() {\n    while (true)\n        o += 1.0;\n}\n", "fragment")[0]
    )
    with pytest.raises(ShaderError, match=r"a loop may not end"):
        run(module, {}, 1)


def test_missing_and_ill_shaped_inputs() -> None:
    module = read(binary())
    with pytest.raises(ShaderError, match=r"^u_m: is an input of the fragment stage, and no value is given$"):
        run(module, {name: value for name, value in INPUTS.items() if name != "u_m"}, 3)
    with pytest.raises(ShaderError, match=r"^v_position: has the shape \(3, 2\); \(3,\) or \(3, 3\) fits the type vec3$"):
        run(module, {**INPUTS, "v_position": np.ones((3, 2))}, 3)
    with pytest.raises(ShaderError, match=r"^Lamps.u_lamps\[1\]: give a mapping with place, power$"):
        run(module, {**INPUTS, "Lamps": {"u_lamps": [INPUTS["Lamps"]["u_lamps"][0], 1, 2, 3]}}, 3)  # type: ignore[index]
