"""Shader tests: unit tests that are written in GLSL, run in float64 and float32 on the CPU, and in both stages on the GPU.

A test is a function `bool test_NAME()` or `bool test_NAME(vec3 l, vec3 v)` in a file *.test.glsl. The second form is run over
many pairs of unit directions above the horizon of +z, and must hold for all of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.errors import AssetError, ShaderError
from glshade.files import read_bytes
from glshade.gl.context import Context
from glshade.gl.evaluation import run_on_gpu
from glshade.glsl.shaders import Shaders, expand
from glshade.glsl.source import Code
from glshade.limits import LARGEST_SHADER
from glshade.spirv.arithmetic import FLOAT32, FLOAT64
from glshade.spirv.compiler import compiled
from glshade.spirv.model import ValueText
from glshade.spirv.ranges import directions
from glshade.spirv.trace import Recorder, Step, short

Array = NDArray[Any]
On = Literal["float64", "float32", "vertex", "fragment"]

SUFFIX = ".test.glsl"
# The head of a test: a function without parameters, or with two vectors.
_TEST = re.compile(
    r"^\s*bool\s+(?P<name>test_\w+)\s*\(\s*(?P<parameters>(?:in\s+)?vec3\s+\w+\s*,\s*(?:in\s+)?vec3\s+\w+|void|)\s*\)"
)
# The names of the places where a test runs.
NAMES: dict[On, str] = {
    "float64": "float64 on the CPU",
    "float32": "float32 on the CPU",
    "vertex": "vertex stage on the GPU",
    "fragment": "fragment stage on the GPU",
}
# The number of pairs of directions at which a test with parameters is run. It takes some milliseconds.
COUNT = 4096


@dataclass(frozen=True)
class ShaderTest:
    """One test.

    path: the file.
    line: the line of its head, counted from 1.
    name: the name of the function.
    directed: whether it takes two directions.
    """

    path: Path
    line: int
    name: str
    directed: bool

    @property
    def id(self) -> str:
        """The test's name for people and for -k: `FILE::NAME`."""
        return f"{self.path}::{self.name}"


@dataclass(frozen=True)
class Failure:
    """A test that failed in one arithmetic.

    on: where it ran: "float64" or "float32" on the CPU, "vertex" or "fragment" on the GPU.
    l, v: the first pair of directions at which it failed.
    failed: the number of pairs at which it failed.
    count: the number of pairs.
    """

    on: On
    l: tuple[float, ...]
    v: tuple[float, ...]
    failed: int
    count: int


@dataclass(frozen=True)
class Outcome:
    """The outcome of a test.

    test: the test.
    failures: where it failed.
    ran: where it ran.
    values: the values of the test's variables at the first failure, in float64 and in float32.
    error: the message of a text that does not compile; empty otherwise.
    """

    test: ShaderTest
    failures: tuple[Failure, ...]
    ran: tuple[On, ...]
    values: tuple[tuple[Step, Step | None], ...] = ()
    error: str = ""

    @property
    def passed(self) -> bool:
        """Whether the test holds wherever it ran."""
        return not self.failures and not self.error

    def report(self) -> list[str]:
        """Returns the lines that say where the test failed, and the values of its variables there; none where it passed."""
        lines = []
        for failure in self.failures:
            share = f" at {failure.failed} of {failure.count} pairs of directions" if self.test.directed else ""
            lines.append(f"{NAMES[failure.on]}: false{share}")
        if self.failures and self.test.directed:
            l, v = (", ".join(f"{x:.9g}" for x in d) for d in (self.failures[0].l, self.failures[0].v))
            lines.append(f"first at l = ({l}), v = ({v})")
        for step, single in self.values:
            values = f"{short(step.value)} in float64, {short(single.value) if single else 'not run'} in float32"
            lines.append(f"{step.place.rpartition(':')[2]}: {step.name} = {values}    {step.text}")
        return lines

    def as_dict(self) -> dict[str, Any]:
        """Returns the outcome as values for JSON."""
        return {
            "file": str(self.test.path),
            "line": self.test.line,
            "name": self.test.name,
            "passed": self.passed,
            "ran": list(self.ran),
            "error": self.error,
            "failures": [vars(failure) for failure in self.failures],
            "report": self.report(),
        }


def test_files(paths: Iterable[Path]) -> Iterator[Path]:
    """Yields the files *.test.glsl among some files and below some folders, in the order of their names.

    Errors: AssetError for a path that does not exist, or that is a file of another name.
    """
    for path in paths:
        if path.is_dir():
            yield from sorted(found for found in path.rglob(f"*{SUFFIX}") if found.is_file())
        elif path.name.endswith(SUFFIX):
            yield path
        else:
            raise AssetError(f"{path}: is neither a folder nor a file *{SUFFIX}")


def find_tests(path: Path) -> list[ShaderTest]:
    """Returns the tests of a file, in the order of the file. Errors: AssetError for a file that cannot be read."""
    return [
        ShaderTest(path, number, match["name"], bool(match["parameters"]) and match["parameters"] != "void")
        for number, line in enumerate(_lines(path), 1)
        if (match := _TEST.match(line))
    ]


def _lines(path: Path) -> list[str]:
    """Returns the lines of a file. Errors: AssetError."""
    try:
        return read_bytes(path, LARGEST_SHADER).decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise AssetError(f"{path}: is not UTF-8 text (byte {error.start})") from None
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror or error}") from None


def run_test(test: ShaderTest, shaders: Shaders, context: Context | None = None, count: int = COUNT, seed: int = 1) -> Outcome:
    """Runs one test in float64 and float32 on the CPU, and in both stages on the GPU where there is a context.

    shaders: the shader files that the test's file may include.
    count: the number of pairs of directions of a test that takes them.
    Errors: AssetError, MissingLibrary.
    """
    l, v = directions(count if test.directed else 1, np.random.default_rng(seed))
    code = _code(test)
    ran: list[On] = []
    failures = []
    try:
        text = _text(test, code, shaders)
        for on, passed in _results(text, code, shaders, context, l, v):
            ran.append(on)
            if not passed.all():
                first = int(np.argmin(passed))
                failed = int(np.count_nonzero(~passed))
                failures.append(Failure(on, tuple(map(float, l[first])), tuple(map(float, v[first])), failed, len(l)))
        values = tuple(_values(test, text, failures[0])) if failures else ()
    except ShaderError as error:
        return Outcome(test, (), tuple(ran), error=str(error))
    return Outcome(test, tuple(failures), tuple(ran), values)


def _results(
    text: ValueText, code: dict[str, Code | str], shaders: Shaders, context: Context | None, l: Array, v: Array
) -> Iterator[tuple[On, NDArray[np.bool_]]]:
    """Yields (where, passed (N,)) for each arithmetic. Errors: ShaderError."""
    inputs = {"a_l": l, "a_v": v}
    yield "float64", text.run(inputs, len(l), FLOAT64)[:, 0] > 0
    yield "float32", text.run(inputs, len(l), FLOAT32)[:, 0] > 0
    if context is not None:
        stages: tuple[Literal["vertex", "fragment"], ...] = ("vertex", "fragment")
        for stage in stages:
            yield stage, run_on_gpu(context, stage, code, {}, l, v, shaders)[:, 0] > 0


def _code(test: ShaderTest) -> dict[str, Code | str]:
    """Returns the code of a program that runs a test. Errors: AssetError."""
    call = f"{test.name}({'l, v' if test.directed else ''})"
    lines = [*_lines(test.path), f"vec3 value(vec3 l, vec3 v) {{ return vec3({call} ? 1.0 : 0.0); }}"]
    return {"model": "\n".join(lines)}


def _text(test: ShaderTest, code: dict[str, Code | str], shaders: Shaders) -> ValueText:
    """Returns the program of a test, whose lines name the test's file. Errors: ShaderError, MissingLibrary."""
    stage = expand("pass/evaluate.vert", code, shaders)
    named = tuple((str(test.path) if file == "<model>" else file, number) for file, number in stage.lines)
    stage = replace(stage, lines=named)
    return ValueText(stage, compiled(stage, "vertex"))


def _values(test: ShaderTest, text: ValueText, failure: Failure) -> Iterator[tuple[Step, Step | None]]:
    """Yields the values of the test's own variables where it failed: each in float64, and in float32 where that ran too."""
    inputs = {"a_l": np.array([failure.l]), "a_v": np.array([failure.v])}
    steps = []
    for arithmetic in (FLOAT64, FLOAT32):
        recorder = Recorder(text.module, text.stage, 1)
        text.run(inputs, 1, arithmetic, recorder.observe)
        steps.append([step for step in recorder.steps if step.function == test.name])
    for index, step in enumerate(steps[0]):
        other = steps[1][index] if index < len(steps[1]) else None
        yield step, other if other is not None and (other.line, other.name) == (step.line, step.name) else None
