"""Every instruction and built-in function that the machine runs, against values by NumPy or by hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
import pytest
from support.texts import expression, module_of, needs_compiler, run_text

from glshade.spirv.library import FREXP, FUNCTIONS, MODF
from glshade.spirv.machine import run
from glshade.spirv.opcodes import TERMINATORS, WITH_RESULT, WITHOUT_RESULT

pytestmark = needs_compiler

X = np.array([-2.5, -0.75, 0.0, 0.3, 1.0, 7.25])
Y = np.array([0.5, -1.25, 3.0, 0.9, 2.0, -0.125])
P = np.array([0.1, 0.35, 0.5, 0.75, 0.999, 1.0])
A = np.array([[0.1, 0.2, 0.3], [1.0, -2.0, 0.5], [0.0, 0.0, 1.0], [3.0, 4.0, 0.0], [-1.0, 0.25, 2.0], [5.0, 1.0, 1.0]])
B = A[::-1].copy()
I, J = np.array([-7, -1, 0, 3, 8, 100]), np.array([2, 3, 5, -2, 3, 7])
U, V = np.array([7, 1, 0, 3, 8, 4_000_000_000]), np.array([2, 3, 5, 2, 3, 7])
M2 = np.array([[1.0, 2.0], [3.0, 5.0]])
M3 = np.array([[2.0, 0.0, 1.0], [0.5, 1.0, 0.0], [0.0, -1.0, 4.0]])
M4 = np.diag([1.0, 2.0, 3.0, 4.0]) + 0.25
GIVEN: dict[str, Any] = {
    **{"x": X, "y": Y, "p": P, "a": A, "b": B, "i": I, "j": J, "u": U, "v": V, "m2": M2, "m3": M3, "m4": M4},
    "c": X > 0,
}
DECLARED = (
    "in float x, y, p;\nin vec3 a, b;\nflat in int i, j;\nflat in uint u, v;\nuniform bool c;\n"
    "uniform mat2 m2;\nuniform mat3 m3;\nuniform mat4 m4;"
)


@dataclass(frozen=True)
class Case:
    """An expression and its values.

    type: its GLSL type.
    text: the expression.
    value: its values (N, ...) or (...).
    """

    type: str
    text: str
    value: Any

    def __str__(self) -> str:
        return self.text


def unit(x: Any) -> Any:
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def dot(a: Any, b: Any) -> Any:
    return (a * b).sum(axis=-1, keepdims=True)


def refracted() -> Any:
    n, i = unit(A), unit(B)
    d = dot(n, i)
    k = 1 - 0.25 * (1 - d * d)
    return 0.5 * i - (0.5 * d + np.sqrt(k)) * n


BITS = X.astype(np.float32).view(np.int32)
CASES = [
    # Floats.
    Case("float", "x + y", X + Y),
    Case("float", "x - y", X - Y),
    Case("float", "x * y", X * Y),
    Case("float", "x / y", X / Y),
    Case("float", "-x", -X),
    Case("float", "mod(x, y)", X - Y * np.floor(X / Y)),
    Case("vec3", "a + b", A + B),
    Case("vec3", "a * x", A * X[:, None]),
    Case("vec3", "m3 * a", A @ M3.T),
    Case("vec3", "a * m3", A @ M3),
    Case("vec3", "(m3 * m3) * a", A @ (M3 @ M3).T),
    Case("vec3", "(m3 * 2.0) * a", 2 * A @ M3.T),
    Case("vec3", "transpose(m3) * a", A @ M3),
    Case("vec3", "outerProduct(a, b) * b", A * dot(B, B)),
    Case("float", "dot(a, b)", dot(A, B)[:, 0]),
    # Integers.
    Case("int", "i + j", I + J),
    Case("int", "i - j", I - J),
    Case("int", "i * j", I * J),
    Case("int", "i / j", np.trunc(I / J).astype(int)),
    Case("int", "-i", -I),
    Case("int", "8 % (j & 7)", np.array([0, 2, 3, 2, 2, 1])),
    Case("int", "i & j", I & J),
    Case("int", "i | j", I | J),
    Case("int", "i ^ j", I ^ J),
    Case("int", "~i", ~I),
    Case("int", "i << 2", I << 2),
    Case("int", "i >> 1", I >> 1),
    Case("uint", "u / v", U // V),
    Case("uint", "u % v", U % V),
    Case("uint", "u >> 1u", U >> 1),
    Case("int", "i * 1000000000", (I * 1_000_000_000).astype(np.int32)),
    Case("int", "int(x)", np.trunc(X)),
    Case("uint", "uint(p * 5.0)", np.trunc(P * 5)),
    Case("float", "float(i)", I),
    Case("float", "float(u)", U),
    Case("int", "floatBitsToInt(x)", BITS),
    Case("float", "intBitsToFloat(floatBitsToInt(x) + 1)", (BITS + 1).view(np.float32)),
    # Comparisons and logic.
    *(
        Case("int", f"x {op} y ? 1 : 0", f(X, Y))
        for op, f in {"<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal}.items()
    ),
    *(
        Case("int", f"i {op} j ? 1 : 0", f(I, J))
        for op, f in {"<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal}.items()
    ),
    *(
        Case("int", f"u {op} v ? 1 : 0", f(U, V))
        for op, f in {"<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal}.items()
    ),
    Case("int", "x == 1.0 ? 1 : 0", X == 1),
    Case("int", "x != 1.0 ? 1 : 0", X != 1),
    Case("int", "i == 3 ? 1 : 0", I == 3),
    Case("int", "i != 3 ? 1 : 0", I != 3),
    Case("int", "any(lessThan(a, b)) ? 1 : 0", (A < B).any(axis=1)),
    Case("int", "all(lessThan(a, b)) ? 1 : 0", (A < B).all(axis=1)),
    Case("int", "(x > 0.0) ^^ (y > 0.0) ? 1 : 0", (X > 0) ^ (Y > 0)),
    Case("int", "(x > 0.0) == (y > 0.0) ? 1 : 0", (X > 0) == (Y > 0)),
    Case("int", "x > 0.0 && y > 0.0 ? 1 : 0", (X > 0) & (Y > 0)),
    Case("int", "x > 0.0 || y > 0.0 ? 1 : 0", (X > 0) | (Y > 0)),
    Case("int", "!(x > 0.0) ? 1 : 0", ~(X > 0)),
    Case("int", "isnan(sqrt(x)) ? 1 : 0", X < 0),
    Case("int", "isinf(1.0 / x) ? 1 : 0", X == 0),
    Case("int", "c && bool(i) ? 1 : 0", (X > 0) & (I != 0)),
    Case("int", "c || bool(i) ? 1 : 0", (X > 0) | (I != 0)),
    Case("vec3", "mix(a, b, lessThan(a, b))", np.where(A < B, B, A)),
    # Composites.
    Case("vec3", "a.zxy", A[:, [2, 0, 1]]),
    Case("vec4", "vec4(a.xy, b.x, 2.0)", np.column_stack([A[:, :2], B[:, 0], np.full(6, 2.0)])),
    Case("float", "a[i & 1]", np.where(I & 1, A[:, 1], A[:, 0])),
    Case("float", "(a + b)[i & 1]", np.where(I & 1, (A + B)[:, 1], (A + B)[:, 0])),
    Case("float", "m3[1][2]", M3[2, 1]),
    # Built-in functions.
    Case("float", "round(x * 1.1)", np.rint(X * 1.1)),
    Case("float", "roundEven(x)", np.rint(X)),
    Case("float", "trunc(x)", np.trunc(X)),
    Case("float", "abs(x)", np.abs(X)),
    Case("int", "abs(i)", np.abs(I)),
    Case("float", "sign(x)", np.sign(X)),
    Case("int", "sign(i)", np.sign(I)),
    Case("float", "floor(x)", np.floor(X)),
    Case("float", "ceil(x)", np.ceil(X)),
    Case("float", "fract(x)", X - np.floor(X)),
    Case("float", "radians(x)", np.radians(X)),
    Case("float", "degrees(x)", np.degrees(X)),
    *(
        Case("float", f"{name}(x)", getattr(np, name)(X))
        for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "exp2")
    ),
    Case("float", "asin(p)", np.arcsin(P)),
    Case("float", "acos(p)", np.arccos(P)),
    Case("float", "atan(x)", np.arctan(X)),
    Case("float", "atan(y, x)", np.arctan2(Y, X)),
    Case("float", "asinh(x)", np.arcsinh(X)),
    Case("float", "acosh(p + 1.0)", np.arccosh(P + 1)),
    Case("float", "atanh(p * 0.5)", np.arctanh(P / 2)),
    Case("float", "pow(p, x)", P**X),
    Case("float", "log(p)", np.log(P)),
    Case("float", "log2(p)", np.log2(P)),
    Case("float", "sqrt(p)", np.sqrt(P)),
    Case("float", "inversesqrt(p)", 1 / np.sqrt(P)),
    Case("float", "determinant(m4)", np.linalg.det(M4)),
    Case("vec3", "inverse(m3) * a", np.linalg.solve(M3, A.T).T),
    Case("float", "min(x, y)", np.minimum(X, Y)),
    Case("float", "max(x, y)", np.maximum(X, Y)),
    Case("int", "min(i, j)", np.minimum(I, J)),
    Case("int", "max(i, j)", np.maximum(I, J)),
    Case("uint", "min(u, v)", np.minimum(U, V)),
    Case("uint", "max(u, v)", np.maximum(U, V)),
    Case("float", "clamp(x, -1.0, 1.0)", np.clip(X, -1, 1)),
    Case("int", "clamp(i, -1, 5)", np.clip(I, -1, 5)),
    Case("uint", "clamp(u, 1u, 5u)", np.clip(U, 1, 5)),
    Case("float", "mix(x, y, p)", X * (1 - P) + Y * P),
    Case("float", "step(0.5, x)", np.where(X < 0.5, 0.0, 1.0)),
    Case("float", "smoothstep(-1.0, 2.0, x)", (lambda t: t * t * (3 - 2 * t))(np.clip((X + 1) / 3, 0, 1))),
    Case("float", "length(a)", np.linalg.norm(A, axis=1)),
    Case("float", "distance(a, b)", np.linalg.norm(A - B, axis=1)),
    Case("vec3", "cross(a, b)", np.cross(A, B)),
    Case("vec3", "normalize(a)", unit(A)),
    Case("vec3", "faceforward(a, b, b)", -A),
    Case("vec3", "reflect(a, normalize(b))", A - 2 * dot(unit(B), A) * unit(B)),
    Case("vec3", "refract(normalize(b), normalize(a), 0.5)", refracted()),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_expression(case: Case) -> None:
    value, _ = run_text(expression(case.type, case.text, DECLARED), len(X), **GIVEN)
    # Literals and the operands of the module are float32 numbers.
    np.testing.assert_allclose(value, np.broadcast_to(case.value, value.shape), rtol=3e-7, atol=1e-7)


def statements(type_: str, body: str, declarations: str = DECLARED) -> str:
    """Returns a fragment stage with these statements, which set `o`."""
    return f"{declarations}\nout {type_} o;\n{body}\n"


PROGRAMS = {
    "modf": (
        "vec2",
        "void main() { float whole; float rest = modf(x, whole); o = vec2(rest, whole); }",
        np.column_stack([X - np.trunc(X), np.trunc(X)]),
    ),
    "a loop that ends at different times": (
        "float",
        "void main() { float s = 0.0; for (int k = 0; k < 12; k++) { if (k > i) break; s += float(k); } o = s; }",
        [0, 0, 0, 6, 36, 66],
    ),
    "continue": (
        "float",
        "void main() { float s = 0.0; for (int k = 0; k < 6; k++) { if (((k + i) & 1) == 0) continue; s += 1.0; } o = s; }",
        [3, 3, 3, 3, 3, 3],
    ),
    "switch": (
        "float",
        "void main() { switch (i) { case -7: o = 1.0; break; case 0: o = 2.0; case 3: o = 3.0; break; default: o = 9.0; } }",
        [1, 9, 3, 3, 9, 9],
    ),
    "early return": (
        "float",
        "float f(float v) { if (v < 0.0) return -1.0; return v; }\nvoid main() { o = f(x); }",
        np.where(X < 0, -1, X),
    ),
    "a function that ends in its branches": (
        "float",
        "float f(float v) { if (v < 0.0) return -1.0; else return 2.0; }\nvoid main() { o = f(x); }",
        np.where(X < 0, -1, 2),
    ),
    "and, or of local variables": (
        "float",
        "void main() { bool v = x > 0.0; bool w = y > 0.0; o = float(v && w) + 2.0 * float(v || w); }",
        ((X > 0) & (Y > 0)) + 2.0 * ((X > 0) | (Y > 0)),
    ),
    "struct": (
        "float",
        "struct S { float q; vec3 w; };\nvoid main() { S s = S(x, a); s.w.y = 2.0; S t = s; o = t.q + t.w.y + t.w.x; }",
        X + 2 + A[:, 0],
    ),
    "array with an index of its own in each lane": (
        "float",
        "void main() { float t[3] = float[3](1.0, 2.0, 4.0); t[i & 1] = 8.0; o = t[0] + 10.0 * t[1]; }",
        np.where(I & 1, 1 + 80, 8 + 20),
    ),
    "inout": ("float", "void f(inout float v) { v *= 2.0; }\nvoid main() { float w = x; f(w); o = w; }", 2 * X),
    "vector with a changed component": (
        "vec3",
        "void main() { vec3 w = a; w[j & 1] = 7.0; o = w; }",
        np.where((np.arange(3) == (J & 1)[:, None]), 7.0, A),
    ),
    "while": (
        "float",
        "void main() { float v = abs(x) + 1.0; while (v < 100.0) v *= 2.0; o = v; }",
        [w for v in np.abs(X) + 1 for w in [v * 2.0 ** np.ceil(np.log2(100 / v))]],
    ),
    "matrix by columns": ("vec3", "void main() { mat3 m = m3; m[1] = a; o = m * vec3(0.0, 1.0, 0.0); }", A),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_program(name: str) -> None:
    type_, body, expected = PROGRAMS[name]
    value, _ = run_text(statements(type_, body), len(X), **GIVEN)
    np.testing.assert_allclose(value, expected, rtol=3e-7, atol=1e-7)


# Functions that GLSL has from version 4.00 on.
LATER = {
    "fma": ("o = fma(x, y, p);", X * Y + P),
    "frexp": ("int e; float s = frexp(x, e); o = s * 10.0 + float(e);", np.frexp(X)[0] * 10 + np.frexp(X)[1]),
    "ldexp": ("o = ldexp(x, j);", np.ldexp(X, J)),
}


def later(name: str) -> str:
    """Returns the stage that tests a function of version 4.00."""
    return f"#version 400 core\n{DECLARED}\nout float o;\nvoid main() {{ {LATER[name][0]} }}\n"


@pytest.mark.parametrize("name", LATER)
def test_function_of_a_later_version(name: str) -> None:
    value, _ = run_text(later(name), len(X), **GIVEN)
    np.testing.assert_allclose(value, LATER[name][1], rtol=3e-7, atol=1e-7)


def test_ordered_comparison_is_false_for_nan() -> None:
    module = module_of(expression("int", "sqrt(x) != 2.0 ? 1 : 0", "in float x;"))
    function = module.functions[module.entry]
    assert [step.name for step in function.instructions].count("FUnordNotEqual") == 1
    steps = (step._replace(name="FOrdNotEqual") if step.name == "FUnordNotEqual" else step for step in function.instructions)
    blocks = tuple(replace(block, instructions=tuple(islice(steps, len(block.instructions)))) for block in function.blocks)
    ordered = replace(module, functions={**module.functions, module.entry: replace(function, blocks=blocks)})
    inputs = {"x": np.array([-1.0, 4.0, 9.0])}
    assert run(module, inputs, 3).outputs["o"].tolist() == [1, 0, 1]
    assert run(ordered, inputs, 3).outputs["o"].tolist() == [0, 0, 1]


def test_discarded_lanes() -> None:
    _, result = run_text(statements("float", "void main() { if (x < 0.0) discard; o = 1.0; }"), len(X), **GIVEN)
    assert (result.discarded == (X < 0)).all()


def test_lanes_that_are_discarded_in_a_function_do_not_go_on() -> None:
    body = "float n = 0.0;\nvoid f() { if (x < 0.0) discard; }\nvoid main() { f(); n += 1.0; o = n; }"
    value, result = run_text(statements("float", body), len(X), **GIVEN)
    assert (value[~result.discarded] == 1).all()
    assert (value[result.discarded] == 0).all()


def test_all_lanes_are_discarded_in_a_function() -> None:
    body = "float f() { discard; return 1.0; }\nvoid main() { o = f() + x; }"
    _, result = run_text(statements("float", body), len(X), **GIVEN)
    assert result.discarded.all()


def test_derivatives() -> None:
    x = np.array([1.0, 3.0, 10.0, 20.0])
    for text, expected in (("dFdx(x)", [2, 2, 10, 10]), ("dFdy(x)", [9, 17, 9, 17]), ("fwidth(x)", [11, 19, 19, 27])):
        value, _ = run_text(expression("float", text, "in float x;"), 4, squares=True, x=x)
        np.testing.assert_allclose(value, expected)


class Picture:
    """A texture that returns what it is asked."""

    def sample(self, at: Any, level: Any, bias: Any, steps: Any) -> Any:
        n = at.shape[1]
        chosen = np.full(n, -1.0) if level is None else level
        across = np.zeros(n) if steps is None else steps[0][0]
        return np.stack(np.broadcast_arrays(at[0], at[1], chosen + bias, across))

    def fetch(self, at: Any, level: Any) -> Any:
        return np.stack(np.broadcast_arrays(at[0], at[1], level, level)).astype(float)

    def size(self, level: Any) -> tuple[int, int]:
        return 64 >> int(level[0]), 32 >> int(level[0])


TEXTURE_CASES = {
    "texture(t, uv)": [0.25, 0.5, -1, 0],
    "texture(t, uv, 2.0)": [0.25, 0.5, 1, 0],
    "textureLod(t, uv, 3.0)": [0.25, 0.5, 3, 0],
    "textureGrad(t, uv, vec2(0.125), vec2(0.0))": [0.25, 0.5, -1, 0.125],
    "textureProj(t, vec3(uv, 0.5))": [0.5, 1, -1, 0],
    "textureProjLod(t, vec3(uv, 0.5), 1.0)": [0.5, 1, 1, 0],
    "texelFetch(t, ivec2(3, 4), 1)": [3, 4, 1, 1],
    "vec4(textureSize(t, 1), 0.0, 0.0)": [32, 16, 0, 0],
}


@pytest.mark.parametrize("text", TEXTURE_CASES)
def test_texture(text: str) -> None:
    value, _ = run_text(
        expression("vec4", text, "uniform sampler2D t;\nuniform vec2 uv;"), 1, t=Picture(), uv=np.array([0.25, 0.5])
    )
    np.testing.assert_allclose(value[0], TEXTURE_CASES[text])


def test_every_instruction_is_tested() -> None:
    texts = [expression(case.type, case.text, DECLARED) for case in CASES]
    texts += [statements(type_, body) for type_, body, _ in PROGRAMS.values()]
    texts += [expression("vec4", text, "uniform sampler2D t;\nuniform vec2 uv;") for text in TEXTURE_CASES]
    texts += [expression("float", text, "in float x;") for text in ("dFdx(x)", "dFdy(x)", "fwidth(x)")]
    texts += map(later, LATER)
    texts.append(statements("float", "void main() { if (x < 0.0) discard; o = 1.0; }"))
    seen: set[str] = set()
    functions: set[int] = set()
    for text in texts:
        for function in module_of(text).functions.values():
            for step in function.instructions:
                seen.add(step.name)
                if step.name == "ExtInst":
                    functions.add(step.operands[1])
    known = set(WITH_RESULT.values()) | set(WITHOUT_RESULT.values()) | set(TERMINATORS.values())
    # Only other releases of the compiler make an ordered comparison.
    assert known - seen == {"FOrdNotEqual"}
    assert FUNCTIONS.keys() | {MODF, FREXP} == functions
