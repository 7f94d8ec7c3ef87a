"""Diagnosis: all errors of a program are found in one go, each at its own line, and consequences are left out."""

from __future__ import annotations

import pytest

from glshade import Renderer, ShaderError
from glshade.gl.diagnosis import diagnose
from glshade.gl.program import Program
from glshade.glsl.source import Source, Stage

VERTEX = "#version 330 core\nvoid main() {\n    gl_Position = vec4(0.0);\n}\n"
FRAGMENT = """#version 330 core
out vec4 o_colour;

struct M {
    vec3 a;
    float b;
};

float f(M m) {
    return m.b;
}

float g(M m, float x) {
    float y = x * 2.0;
    return y + f(m);
}

void main() {
    M m;
    m.a = vec3(1.0);
    o_colour = vec4(g(m, 1.0), m.a);
}
"""


def stage(text: str, name: str) -> Stage:
    return Stage(text, tuple((name, number) for number, _ in enumerate(text.splitlines(), 1)))


def found(renderer: Renderer, fragment: str, vertex: str = VERTEX) -> list[str]:
    """Returns the `file:line` of each problem of a program."""
    problems = diagnose(renderer.context, Source(stage(vertex, "v.vert"), stage(fragment, "f.frag")))
    return [f"{problem.file}:{problem.line}" for problem in problems]


def edited(*edits: tuple[str, str]) -> str:
    text = FRAGMENT
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


IN_F, IN_G = ("m.b;", "m.c;"), ("x * 2.0", "unknown * 2.0")


@pytest.mark.parametrize(
    ("edits", "lines"),
    [
        ((), []),
        ((IN_F, IN_G), [10, 14]),
        # The semicolon is missed in the line after it, and the rest of the file is read as if it were there.
        ((("m.b;", "m.b"), ("2.0;", "2.0 +;"), ("vec3(1.0)", "vec3(1.0")), [11, 14, 20]),
        ((("};", "}"), IN_F), [9, 10]),
        ((("vec3 a;", "vec3 a"), IN_F, IN_G), [6, 10, 14]),
        # Nothing can be said about calls of a function whose head is at fault.
        ((("M m, float x", "M m float x"), IN_F), [10, 13]),
        ((("float g(M m,", "float g(N m,"), IN_F), [10, 13]),
        ((("m.b;\n}", "m.b;\n"), IN_G), [13, 14]),
        ((("m.a);\n}", "m.a);\n"), IN_G), [14, 21]),
        ((("out vec4 o_colour;", "@@ $$\nout vec4 o_colour;"), IN_G), [2, 15]),
        ((("x * 2.0", "(unknown - x) * 2.0 + missing"),), [14, 14]),
        # Mesa reports three errors of this line, two of them because of the first.
        ((("return y + f(m)", "return unknown + f(m)"),), [15]),
    ],
)
def test_all_errors_of_a_stage(edits: tuple[tuple[str, str], ...], lines: list[int], renderer: Renderer) -> None:
    assert sorted(found(renderer, edited(*edits))) == sorted(f"f.frag:{line}" for line in lines)


def test_errors_of_both_stages(renderer: Renderer) -> None:
    assert found(renderer, edited(IN_F), VERTEX.replace("vec4(0.0)", "vec4(nothing)")) == ["v.vert:3", "f.frag:10"]


def test_a_link_error_names_both_stages(renderer: Renderer) -> None:
    vertex = VERTEX.replace("void main() {", "out vec3 v_x;\n\nvoid main() {\n    v_x = vec3(1.0);")
    fragment = "#version 330 core\nin vec4 v_x;\nout vec4 o_colour;\n\nvoid main() {\n    o_colour = v_x;\n}\n"
    (problem,) = diagnose(renderer.context, Source(stage(vertex, "v.vert"), stage(fragment, "f.frag")))
    assert (problem.stage, problem.file, problem.line, problem.column) == ("link", "v.vert", 2, 10)
    assert "(vertex stage: v.vert:2, fragment stage: f.frag:2)" in problem.message
    assert problem.excerpt[problem.line - (problem.first_line or 0)] == "out vec3 v_x;"


def test_a_column_is_that_of_the_file(renderer: Renderer) -> None:
    """Mesa counts in a text in which runs of white space and comments are one space."""
    fragment = FRAGMENT.replace("    float y = x * 2.0;", "        float y = /* a comment */  unknown;  // more")
    with pytest.raises(ShaderError) as caught, renderer.context.gl:
        Program(renderer.context, Source(stage(VERTEX, "v.vert"), stage(fragment, "f.frag")))
    (problem,) = caught.value.problems
    assert problem.column == 36
    shown = problem.text().splitlines()
    caret = next(index for index, line in enumerate(shown) if line.endswith("^"))
    assert shown[caret - 1][shown[caret].index("^") :].startswith("unknown")
