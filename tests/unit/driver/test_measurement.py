"""All measurements together, and `glshade doctor`, which reports them."""

from __future__ import annotations

import json
import time
from typing import Any

import click.testing
import pytest

from glshade.cli.doctor import command
from glshade.driver.arithmetic import FUNCTIONS
from glshade.driver.measurement import measure
from glshade.errors import ContextError
from glshade.gl.context import Context
from glshade.glsl.source import Stage


def test_the_result_is_json(found: dict[str, Any]) -> None:
    json.dumps(found, allow_nan=False)
    assert list(found) == [
        *("built_ins", "fma", "contracted", "precise", "compensated_sum_without_precise", "mix_at_its_end", "denormals"),
        *("loop_rounds", "formats", "timer_query", "subpixel_bits", "interpolation_shift_in_steps", "clips_at_sides"),
        *("sample_positions", "level_of_detail", "filter_weight_error", "srgb_decoding", "table_weight_error"),
    ]


def test_a_timer_query_gives_no_more_than_the_wall_clock(found: dict[str, Any]) -> None:
    assert found["timer_query"]["wall_s"] > 0
    assert found["timer_query"]["share"] <= 1.1


def test_a_shader_that_does_not_compile(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    nonsense = Stage("nonsense\n", (("nonsense.glsl", 1),))
    monkeypatch.setattr("glshade.driver.programs.expand", lambda name, generated: nonsense)
    with pytest.raises(ContextError, match=r"refuses a shader.*nonsense\.glsl:1") as caught:
        measure(context)
    assert "\n" not in str(caught.value)


class TestDoctor:
    """The command `glshade doctor`."""

    def test_json(self) -> None:
        start = time.perf_counter()
        result = click.testing.CliRunner().invoke(command, ["--json"])
        assert result.exit_code == 0
        # It takes 0.8 s on two idle cores, and longer on a busy machine.
        assert time.perf_counter() - start < 10
        report = json.loads(result.output)
        assert report["well"] is True
        assert report["error"] is None
        assert report["opengl"]["renderer"]
        assert set(report["measured"]["built_ins"]) == {function.name for function in FUNCTIONS}
        assert all(assumption["holds"] for assumption in report["assumptions"])

    def test_json_where_nothing_can_be_drawn(self) -> None:
        result = click.testing.CliRunner().invoke(command, ["--json", "--device", "99"])
        assert result.exit_code == 5
        report = json.loads(result.output)
        assert report["well"] is False
        assert "there is no EGL device 99" in report["error"]

    def test_a_driver_that_refuses_a_measurement_still_draws(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def refuse(context: Context) -> dict[str, Any]:
            raise ContextError("the driver refuses a shader that measures it: no")

        monkeypatch.setattr("glshade.driver.measurement.measure", refuse)
        result = click.testing.CliRunner().invoke(command)
        assert result.exit_code == 0
        assert "not measured: the driver refuses" in result.output
        assert result.output.endswith("all is well\n")
