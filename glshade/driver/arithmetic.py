"""Arithmetic: measures how exactly a driver computes, and which transformations its compiler makes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.driver.figures import rounded
from glshade.driver.programs import COVER, load_program
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.gl.screen import Capture, Screen

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]

# A built-in function is evaluated at the pixels of a square with this side [pixels].
SIDE = 64
# The number of rounds of a test loop. A driver that runs all of them has no limit that matters. llvmpipe stops after 65,535 in
# Mesa 22, and runs all in Mesa 25.
ROUNDS = 200_000
# The names of the questions that shaders/driver/probe.glsl answers about a driver, in the order of that file.
PROBES = ("mix", "contracted", "two_sum", "denormal_operand", "denormal_result", "loop", "fma", "precise_two_sum")
# Uniform -> operand of the questions; shaders/driver/probe.glsl explains each of them.
OPERANDS = {
    "u_one": 1.0,
    "u_large": 1e8,
    "u_near_one": 1 + 2.0**-12,
    "u_sum": -(1 + 2.0**-11),
    "u_small": 1e-9,
    "u_denormal": 2.0**-130,
    "u_normal": 2.0**-126,
    "u_eighth": 0.125,
}


@dataclass(frozen=True)
class BuiltIn:
    """A built-in function or operator of GLSL, and the ranges of arguments for which it is measured.

    name: the name of the function, or the operator.
    exact: the same function in float64. It takes two arrays, and ignores the second one if the function has one argument.
    first: the range of the first argument.
    second: the range of the second argument; None if the function has only one.
    logarithmic: True if random arguments are spread evenly over the decades of their range, False if evenly over the range.
    """

    name: str
    exact: Callable[[Array, Array], Array]
    first: tuple[float, float]
    second: tuple[float, float] | None = None
    logarithmic: bool = False

    @property
    def ranges(self) -> list[tuple[float, float]]:
        """The range of each argument."""
        return [self.first] if self.second is None else [self.first, self.second]

    def arguments(self, random: np.random.Generator) -> Float32:
        """Returns random arguments, (SIDE * SIDE, 2). The second column is 0 if the function has one argument."""
        columns = np.zeros((SIDE * SIDE, 2), dtype=np.float32)
        for column, (low, high) in enumerate((self.first, self.second or (0.0, 0.0))):
            share = random.uniform(size=SIDE * SIDE)
            logarithmic = self.logarithmic and low > 0
            columns[:, column] = low * (high / low) ** share if logarithmic else low + (high - low) * share
        return columns


_THOUSAND = (1e-3, 1e3)
_MILLION = (1e-6, 1e6)
# The functions, in the order of the cases in shaders/driver/built_ins.frag.
FUNCTIONS = (
    BuiltIn("+", lambda a, b: a + b, _THOUSAND, _THOUSAND, logarithmic=True),
    BuiltIn("-", lambda a, b: a - b, _THOUSAND, _THOUSAND, logarithmic=True),
    BuiltIn("*", lambda a, b: a * b, _THOUSAND, _THOUSAND, logarithmic=True),
    BuiltIn("/", lambda a, b: a / b, _THOUSAND, _THOUSAND, logarithmic=True),
    BuiltIn("sqrt", lambda a, b: np.sqrt(a), _MILLION, logarithmic=True),
    BuiltIn("inversesqrt", lambda a, b: 1 / np.sqrt(a), _MILLION, logarithmic=True),
    BuiltIn("exp2", lambda a, b: np.exp2(a), (-20.0, 20.0)),
    BuiltIn("log2", lambda a, b: np.log2(a), (0.5, 2.0)),
    BuiltIn("sin", lambda a, b: np.sin(a), (-math.pi, math.pi)),
    BuiltIn("cos", lambda a, b: np.cos(a), (-math.pi, math.pi)),
    BuiltIn("pow", lambda a, b: a**b, (0.5, 1.0), (0.0, 100.0)),
    BuiltIn("acos", lambda a, b: np.arccos(a), (-1.0, 1.0)),
    BuiltIn("atan", lambda a, b: np.arctan(a), (-10.0, 10.0)),
)


def measure_arithmetic(context: Context) -> dict[str, Any]:
    """Measures the errors of built-in functions, and the answers of both stages to the questions of shaders/driver/probe.glsl.

    Returns a dictionary ready for JSON. Errors: ShaderError, ContextError.
    """
    has_fma = context.gl.version_code >= 400
    fragment, vertex = _probe_fragment(context, has_fma), _probe_vertex(context, has_fma)
    stages = {"vertex": vertex, "fragment": fragment}
    precise = fragment["precise_two_sum"] != 0 and vertex["precise_two_sum"] != 0
    return {
        "built_ins": measure_built_ins(context),
        "fma": {"offered": has_fma, "fused": fragment["fma"] != 0 if has_fma else None},
        "contracted": {stage: answers["contracted"] != 0 for stage, answers in stages.items()},
        "precise": {"offered": has_fma, "kept": precise if has_fma else None},
        "compensated_sum_without_precise": fragment["two_sum"] != 0,
        "mix_at_its_end": fragment["mix"],
        "denormals": {
            stage: {"read": answers["denormal_operand"] != 0, "made": answers["denormal_result"] != 0}
            for stage, answers in stages.items()
        },
        "loop_rounds": {"tried": ROUNDS, **{stage: int(answers["loop"]) for stage, answers in stages.items()}},
    }


def load_built_in(context: Context, name: str) -> Program:
    """Returns the program that evaluates a built-in function at each pixel of a screen; see shaders/driver/built_ins.frag."""
    program = load_program(context, COVER, "driver/built_ins.frag")
    select(program, name)
    return program


def select(program: Program, name: str) -> None:
    """Makes the program of `load_built_in` evaluate another function."""
    program.set_integer("u_function", [function.name for function in FUNCTIONS].index(name))


def measure_built_ins(context: Context) -> dict[str, dict[str, Any]]:
    """Returns name of a built-in function -> a dictionary with its largest error:

    "ulp": the error in units in the last place (ULP) of the exact result.
    "absolute": the error as a difference.
    "arguments": the ranges of the arguments.
    Errors: ShaderError.
    """
    random = np.random.default_rng(1)
    screen, program = Screen(context, (SIDE, SIDE)), load_built_in(context, FUNCTIONS[0].name)
    found: dict[str, dict[str, Any]] = {}
    for function in FUNCTIONS:
        arguments = function.arguments(random)
        screen.upload(np.pad(arguments, ((0, 0), (0, 2))).reshape(SIDE, SIDE, 4))
        select(program, function.name)
        screen.draw(program)
        exact = function.exact(*arguments.T.astype(np.float64))
        error = np.abs(screen.readback()[..., 0].ravel() - exact)
        with np.errstate(over="ignore"):
            ulp = error / np.spacing(np.abs(exact).astype(np.float32)).astype(np.float64)
        found[function.name] = {
            "ulp": rounded(ulp.max()),
            "absolute": rounded(error.max()),
            "arguments": function.ranges,
        }
    return found


def _probe_fragment(context: Context, has_fma: bool) -> dict[str, float]:
    """Returns name in PROBES -> the fragment stage's answer."""
    program = load_program(context, COVER, "driver/probe.frag", _version(has_fma))
    _write_operands(program)
    screen = Screen(context, (len(PROBES), 1))
    screen.draw(program)
    return dict(zip(PROBES, screen.readback()[0, :, 0].tolist(), strict=True))


def _probe_vertex(context: Context, has_fma: bool) -> dict[str, float]:
    """Returns name in PROBES -> the vertex stage's answer."""
    program = load_program(context, "driver/probe.vert", generated=_version(has_fma), varyings=("v_value",))
    _write_operands(program)
    capture = Capture(context, len(PROBES), 1)
    capture.draw(program)
    return dict(zip(PROBES, capture.readback()[:, 0].tolist(), strict=True))


def _version(has_fma: bool) -> dict[str, str]:
    """Returns the first line of the probes' shaders. It depends on has_fma, because `fma` and `precise` need GLSL 4.00."""
    return {"version": f"#version {400 if has_fma else 330} core"}


def _write_operands(program: Program) -> None:
    for name, value in OPERANDS.items():
        program.write(name, np.array([value], dtype=np.float32))
    program.set_integer("u_rounds", ROUNDS)
