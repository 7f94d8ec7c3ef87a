"""What `glshade doctor` measures: against what is known of arithmetic, and of drivers that break an assumption."""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Iterator
from typing import Any

import click.testing
import pytest

from glshade.cli.doctor import command
from glshade.driver import measurement as measure
from glshade.errors import ContextError
from glshade.gl.context import Context, open_context


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    context = open_context()
    yield context
    context.release()


@pytest.fixture(scope="module")
def found(context: Context) -> dict[str, Any]:
    return measure.measure(context)


def test_what_any_driver_must_have(found: dict[str, Any]) -> None:
    """OpenGL 4.6 core, 2.3.4.1 and 14.3: the least that is allowed."""
    functions = found["built_ins"]
    assert set(functions) == {one.name for one in measure.FUNCTIONS}
    assert all(functions[name]["ulp"] <= 1 for name in "+-*")
    assert functions["sin"]["absolute"] < 1e-3
    assert functions["acos"]["absolute"] < 1e-2
    assert found["mix_at_its_end"] in (0.0, 1.0)
    assert found["formats"]["RGBA8"]["lsb"] <= 1
    assert found["formats"]["RGB10_A2"]["lsb"] <= 1
    assert found["formats"]["RGBA16F"]["relative"] <= 2.0**-10
    assert found["formats"]["R11F_G11F_B10F"]["relative"] <= 2.0**-6
    assert found["subpixel_bits"]["told"] >= 4
    assert found["timer_query"]["wall_s"] > 0
    assert all(0 <= x <= 1 for place in found["sample_positions"] for x in place)
    json.dumps(found, allow_nan=False)


def test_two_ways_to_the_same_answer(found: dict[str, Any], context: Context) -> None:
    """The slid edge finds the bits that the driver tells; a query tells no more than the wall's clock."""
    assert found["subpixel_bits"]["measured"] == found["subpixel_bits"]["told"]
    assert found["timer_query"]["share"] <= 1.1
    assert len(found["sample_positions"]) in (0, context.gl.max_samples)


def test_llvmpipe(found: dict[str, Any], context: Context) -> None:
    """The figures that the shaders were written for."""
    with context.gl:
        renderer = context.renderer
    if "llvmpipe" not in renderer:
        pytest.skip(f"of another driver: {renderer}")
    functions = found["built_ins"]
    assert all(functions[name]["ulp"] <= 0.501 for name in ("+", "-", "*", "/", "sqrt"))
    assert 0.6 < functions["inversesqrt"]["ulp"] <= 2
    assert 1e-4 < functions["acos"]["absolute"] < 1e-3, "why no shader here uses acos"
    assert found["fma"]["fused"] is False
    assert found["contracted"] == {"vertex": False, "fragment": False}
    assert found["precise"]["kept"] is True
    assert found["loop_rounds"]["fragment"] == found["loop_rounds"]["vertex"] == 65535
    assert found["formats"]["RGBA16F"]["rounding"] == "toward zero"
    assert found["interpolation_shift_in_steps"] == pytest.approx(0, abs=0.01)


def test_the_renderer_may_rely_on_this_driver(found: dict[str, Any], context: Context) -> None:
    assert [one.what for one in measure.assumptions(context, found) if not one.holds] == []


BROKEN: dict[str, tuple[tuple[Any, ...], Any, str]] = {
    "arithmetic": (("built_ins", "inversesqrt", "ulp"), 50.0, "docs/accuracy.md"),
    "not a number": (("built_ins", "exp2", "ulp"), 1e308, "docs/accuracy.md"),
    "loops": (("loop_rounds", "fragment"), 255, "missing"),
    "float storage": (("formats", "RGBA32F", "exact"), False, "linear pictures"),
    "bytes": (("formats", "RGBA8", "lsb"), 1.0, "off by one"),
    "grid": (("subpixel_bits", "measured"), 4, "another grid"),
    "snapping": (("interpolation_shift_in_steps",), 0.4, "1/512"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_assumption_is_told(
    name: str, found: dict[str, Any], context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys, value, follows = BROKEN[name]
    broken = copy.deepcopy(found)
    place = broken
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    (one,) = [one for one in measure.assumptions(context, broken) if not one.holds]
    assert follows in one.follows
    monkeypatch.setattr(measure, "measure", lambda context: broken)
    result = click.testing.CliRunner().invoke(command)
    assert result.exit_code == 0, "a picture can be drawn"
    assert f"CAUTION: glshade assumes {one.what}" in result.output
    assert "1 caution\n" in result.output
    assert "all is well" not in result.output


def test_json(monkeypatch: pytest.MonkeyPatch) -> None:
    start = time.perf_counter()
    result = click.testing.CliRunner().invoke(command, ["--json"])
    assert result.exit_code == 0
    # 0.8 s on two cores; a busy machine may take longer.
    assert time.perf_counter() - start < 10
    told = json.loads(result.output)
    assert told["well"] is True
    assert told["error"] is None
    assert told["opengl"]["renderer"]
    assert set(told["measured"]["built_ins"]) == {one.name for one in measure.FUNCTIONS}
    assert all(one["holds"] for one in told["assumptions"])


def test_json_where_nothing_can_be_drawn() -> None:
    result = click.testing.CliRunner().invoke(command, ["--json", "--device", "99"])
    assert result.exit_code == 5
    told = json.loads(result.output)
    assert told["well"] is False
    assert "there is no EGL device 99" in told["error"]


def test_a_driver_that_refuses_a_probe_still_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(context: Context) -> dict[str, Any]:
        raise ContextError("the driver refuses a shader of the doctor's: no")

    monkeypatch.setattr(measure, "measure", refuse)
    result = click.testing.CliRunner().invoke(command)
    assert result.exit_code == 0
    assert "not measured: the driver refuses" in result.output
    assert result.output.endswith("all is well\n")


def test_a_probe_that_does_not_compile(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "PROBE", "nonsense")
    with pytest.raises(ContextError, match="refuses a shader") as caught:
        measure.measure(context)
    assert "\n" not in str(caught.value)
