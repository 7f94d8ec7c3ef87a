"""Measured texture filtering agrees with what OpenGL demands and with what is known of llvmpipe."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from glshade.driver import detail
from glshade.driver.detail import measure_detail
from glshade.gl.context import Context
from glshade.radiance.sampler import RULES
from glshade.textures.volume import Volume


def test_every_driver_is_within_the_limits_of_opengl(found: dict[str, Any]) -> None:
    """OpenGL 4.6 core, 8.14.1, and 8 bits for the weights, as all GPUs have at least."""
    assert found["level_of_detail"]["rule"] in RULES or found["level_of_detail"]["error"] <= 0.1
    assert found["filter_weight_error"] <= 1 / 256
    assert found["table_weight_error"] <= 1 / 256


@pytest.mark.usefixtures("llvmpipe")
def test_llvmpipe(found: dict[str, Any]) -> None:
    assert found["level_of_detail"]["rule"] == "length"
    assert found["level_of_detail"]["error"] == pytest.approx(0.043, abs=1e-3)
    assert found["filter_weight_error"] < 1e-6
    assert found["table_weight_error"] < 1e-6


def shows(monkeypatch: pytest.MonkeyPatch, level: Any) -> None:
    """Replaces the driver by one whose squares of pixels show level(dx, dy), where dx and dy are in texels."""

    def draw(context: Any, program: Any, chain: Any, changes: Any) -> Any:
        shown = level(*np.split(changes * detail.SIDE, 2, axis=1))
        return np.broadcast_to(shown[:, None, None], (len(changes), 2, 2)), changes

    monkeypatch.setattr(detail, "_draw", draw)


@pytest.mark.parametrize("rule", RULES)
def test_each_rule_is_recognised(rule: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    shows(monkeypatch, lambda dx, dy: np.log2(RULES[rule](dx, dy)) + 0.05)
    found = detail._level_of_detail(None, None, np.random.default_rng(0))  # type: ignore[arg-type]
    assert found == {"rule": rule, "error": pytest.approx(0.05)}


def test_a_rule_between_those_of_opengl_is_not_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    shows(monkeypatch, lambda dx, dy: np.log2((RULES["largest"](dx, dy) + RULES["sum"](dx, dy)) / 2))
    found = detail._level_of_detail(None, None, np.random.default_rng(0))  # type: ignore[arg-type]
    assert found == {"rule": None, "error": 0.0}


def test_a_level_outside_of_the_range_of_opengl_counts_as_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    shows(monkeypatch, lambda dx, dy: np.log2(RULES["sum"](dx, dy)) + 0.3)
    found = detail._level_of_detail(None, None, np.random.default_rng(0))  # type: ignore[arg-type]
    assert found == {"rule": None, "error": pytest.approx(0.3)}


def test_the_weights_of_a_table_are_measured_along_all_three_sides(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """A driver whose weights are off by a quarter along one side alone has that error."""
    upload = detail.upload_table
    for axis in range(3):
        off = [0.0, 0.0, 0.0]
        off[axis] = 0.25

        def coarse(context: Context, volume: Volume, off: list[float] = off) -> Any:
            # The texel that is 1 along this side becomes 1.25, which adds a quarter of the weight.
            return upload(context, replace(volume, texels=(volume.texels * (1 + np.array(off))).astype(np.float16)))

        monkeypatch.setattr(detail, "upload_table", coarse)
        with context.gl:
            found = detail._table_weight_error(context, np.random.default_rng(0))
        assert found == pytest.approx(0.25, abs=0.01)


def test_a_context_that_cannot_look_up_functions_gets_the_same_levels(
    context: Context, found: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """There moderngl itself makes the levels of a texture."""
    monkeypatch.setattr(Context, "procedure", lambda *arguments: None)
    with context.gl:
        measured = measure_detail(context)
        # These levels are float32, which the processor has decoded.
        assert measured.pop("srgb_decoding")["error"] < 1e-3
        assert measured == {key: found[key] for key in ("level_of_detail", "filter_weight_error", "table_weight_error")}
