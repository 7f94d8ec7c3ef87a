"""Traces: the values of all variables on the CPU and on the GPU, and the result as `evaluate` gives it."""

from __future__ import annotations

import numpy as np
import pytest
from support.strategies import directions
from support.texts import needs_compiler

from glshade import BRDFS, Renderer, evaluate, trace
from glshade.debug.tracing import TracedStep, paired
from glshade.spirv.trace import Step

pytestmark = needs_compiler


@pytest.mark.parametrize("name", BRDFS)
def test_values_on_cpu_and_gpu(name: str, renderer: Renderer) -> None:
    material, l, v = BRDFS[name](), directions(1, 3)[0], directions(1, 4)[0]
    steps = trace(material, l, v, context=renderer.context).steps
    results = [step for step in steps if step.name == "return" and step.place.startswith("<model>")]
    for result in results:
        np.testing.assert_allclose(result.float64, evaluate(material, l, v, on="text"), rtol=1e-12)
        for on, value in (("vertex", result.vertex), ("fragment", result.fragment)):
            np.testing.assert_array_equal(value, evaluate(material, l, v, on=on, context=renderer.context))  # type: ignore[arg-type]
    assert len(results) == 1
    known = 0
    for step in steps:
        for value in (step.float32, step.vertex, step.fragment):
            if value is None or isinstance(value, tuple) or step.type not in ("float", "vec2", "vec3"):
                continue
            known += 1
            size = np.abs(step.float64).max()
            assert np.abs(np.asarray(value, np.float64) - step.float64).max() <= 1e-4 * max(size, 1e-3), step
    assert known >= 3


def test_steps_are_those_of_the_text() -> None:
    steps = trace(BRDFS["lambert"](kd=0.5), (0, 0, 1), (0, 0, 1), gpu=False).steps
    (n,) = [step for step in steps if step.name == "NoL"]
    assert (n.type, n.float64, n.float32, n.vertex) == ("float", 1.0, 1.0, None)
    assert n.place.endswith("brdf/lambert.glsl:10")
    assert n.text == "float NoL = dot(f.n, l);"
    table = str(trace(BRDFS["lambert"](), (0, 0, 1), (0, 0, 1), gpu=False)).splitlines()
    assert table[0].split()[:3] == ["line", "variable", "float64"]
    assert any(line.split()[:3] == ["lambert.glsl:10", "NoL", "1"] for line in table)


def test_lost_digits_count_from_the_rounding_of_one_number() -> None:
    def digits(float64: object, float32: object) -> float:
        return TracedStep("a:1", "", "f", "x", "float", float64, float32).digits

    one, rounded = np.float64(1), np.float32(1)
    assert digits(one, rounded) == digits(1 + np.float64(2**-25), rounded) == 0
    assert digits(one, np.float32(1 + 2**-23)) == pytest.approx(np.log10(2))
    assert digits(one, np.float32(1.001)) == pytest.approx(np.log10(1e-3 * 2**24), abs=1e-3)
    assert digits(np.array([1.0, 1e-9]), np.array([1, 2e-9], np.float32)) == 0, "relative to the largest component"
    assert digits(one, np.float32("nan")) == digits(one, np.float32("inf")) == pytest.approx(np.log10(2**24))
    assert digits(np.float64("inf"), np.float32("inf")) == 0
    assert digits(np.float64(1e-60), np.float32(0)) == 0, "a driver may flush it to zero"
    assert digits(one, None) == digits(np.bool_(True), np.bool_(False)) == 0


def test_a_step_that_float32_does_not_run_has_no_partner() -> None:
    def step(line: int, name: str) -> Step:
        return Step(line, f"a:{line}", "", "f", name, "float", np.zeros(1), np.ones(1, np.bool_))

    exact = [step(1, "x"), step(2, "y"), step(2, "y"), step(3, "z")]
    single = [step(1, "x"), step(2, "y"), step(3, "z")]
    assert [other and other.line for _, other in paired(exact, single)] == [1, 2, None, 3]


def test_what_it_refuses() -> None:
    with pytest.raises(ValueError, match=r"must have shape \(3,\)"):
        trace(BRDFS["lambert"](), (0, 0, 1), np.zeros((2, 3)), gpu=False)
