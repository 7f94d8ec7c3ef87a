"""Unit tests in GLSL: what is found, where it runs, and what a failure shows."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.texts import needs_compiler

from glshade import Renderer
from glshade.debug.shader_test import Outcome, find_tests, run_test, test_files
from glshade.errors import AssetError
from glshade.glsl.shaders import current

pytestmark = needs_compiler
# pytest would take the function for a test.
test_files.__test__ = False  # type: ignore[attr-defined]

TEXT = """#include "math/unit.glsl"

bool test_passes() {
    return abs(length(unit(vec3(3.0, 4.0, 0.0))) - 1.0) < 1e-6;
}

bool test_loses_digits(vec3 l, vec3 v) {
    float small = 1e-9 * l.z;
    float root = sqrt(1.0 + small);
    return root > 1.0;
}

bool test_is_false(vec3 l, vec3 v) {
    float z = l.z;
    return z < 0.5;
}

float test_is_no_test() {
    return 1.0;
}
"""


def outcomes(tmp_path: Path, text: str, renderer: Renderer | None = None) -> dict[str, Outcome]:
    path = tmp_path / "a.test.glsl"
    path.write_text(text)
    context = renderer.context if renderer else None
    return {test.name: run_test(test, current(), context, count=256) for test in find_tests(path)}


def test_where_a_test_fails(tmp_path: Path, renderer: Renderer) -> None:
    found = outcomes(tmp_path, TEXT, renderer)
    assert list(found) == ["test_passes", "test_loses_digits", "test_is_false"]
    assert found["test_passes"].passed
    assert found["test_passes"].ran == ("float64", "float32", "vertex", "fragment")
    assert [failure.on for failure in found["test_loses_digits"].failures] == ["float32", "vertex", "fragment"]
    everywhere = found["test_is_false"].failures
    assert [failure.on for failure in everywhere] == ["float64", "float32", "vertex", "fragment"]
    assert len({(failure.l, failure.failed) for failure in everywhere}) == 1
    assert 0 < everywhere[0].failed < everywhere[0].count == 256


def test_a_failure_shows_the_values(tmp_path: Path) -> None:
    outcome = outcomes(tmp_path, TEXT)["test_loses_digits"]
    assert outcome.ran == ("float64", "float32")
    report = "\n".join(outcome.report())
    small = f"{1e-9 * outcome.failures[0].l[2]:.7g}"
    assert f"8: small = {small} in float64, {small} in float32    float small = 1e-9 * l.z;" in report
    assert "9: root = 1 in float64, 1 in float32    float root = sqrt(1.0 + small);" in report
    assert "10: return = true in float64, false in float32" in report


def test_a_text_that_does_not_compile(tmp_path: Path) -> None:
    (outcome,) = outcomes(tmp_path, "bool test_a() {\n    return b;\n}\n").values()
    assert not outcome.passed
    assert outcome.error == f"{tmp_path}/a.test.glsl:2: 'b' : undeclared identifier (glslangValidator)"


def test_files_of_folders(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    for name in ("b/z.test.glsl", "a.test.glsl", "a.glsl"):
        (tmp_path / name).write_text("")
    assert [path.name for path in test_files([tmp_path])] == ["a.test.glsl", "z.test.glsl"]
    with pytest.raises(AssetError, match=r"a.glsl: is neither a folder nor a file \*.test.glsl"):
        list(test_files([tmp_path / "a.glsl"]))
