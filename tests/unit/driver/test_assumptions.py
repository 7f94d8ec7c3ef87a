"""Assumptions hold on the driver at hand, and `glshade doctor` warns where one is broken."""

from __future__ import annotations

import copy
from typing import Any

import click.testing
import pytest

from glshade.cli.doctor import command
from glshade.driver.assumptions import check_assumptions
from glshade.gl.context import Context


def test_the_renderer_may_rely_on_this_driver(found: dict[str, Any], context: Context) -> None:
    assert [assumption.what for assumption in check_assumptions(context, found) if not assumption.holds] == []


# A case -> the keys of a measurement, a value that breaks an assumption, and a word of the warning.
BROKEN: dict[str, tuple[tuple[Any, ...], Any, str]] = {
    "arithmetic": (("built_ins", "inversesqrt", "ulp"), 50.0, "docs/accuracy.md"),
    "not a number": (("built_ins", "exp2", "ulp"), 1e308, "docs/accuracy.md"),
    "loops": (("loop_rounds", "fragment"), 255, "missing"),
    "float storage": (("formats", "RGBA32F", "exact"), False, "linear pictures"),
    "bytes": (("formats", "RGBA8", "lsb"), 1.0, "off by one"),
    "grid": (("subpixel_bits", "measured"), 4, "more pixels ambiguous"),
    "snapping": (("interpolation_shift_in_steps",), 0.4, "1/512"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_assumption_is_reported(
    name: str, found: dict[str, Any], context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys, value, follows = BROKEN[name]
    broken = copy.deepcopy(found)
    place = broken
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    (assumption,) = [assumption for assumption in check_assumptions(context, broken) if not assumption.holds]
    assert follows in assumption.follows
    monkeypatch.setattr("glshade.driver.measurement.measure", lambda context: broken)
    result = click.testing.CliRunner().invoke(command)
    assert result.exit_code == 0, "a picture can be drawn"
    assert f"CAUTION: glshade assumes {assumption.what}" in result.output
    assert "1 caution\n" in result.output
    assert "all is well" not in result.output
