"""Measured arithmetic agrees with what OpenGL demands and with what is known of llvmpipe."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glshade.driver.arithmetic import FUNCTIONS, SIDE


def test_every_driver_is_within_the_limits_of_opengl(found: dict[str, Any]) -> None:
    """OpenGL 4.6 core, 2.3.4.1."""
    functions = found["built_ins"]
    assert set(functions) == {function.name for function in FUNCTIONS}
    assert all(functions[name]["ulp"] <= 1 for name in "+-*")
    assert functions["sin"]["absolute"] < 1e-3
    assert functions["acos"]["absolute"] < 1e-2
    assert found["mix_at_its_end"] in (0.0, 1.0)


@pytest.mark.usefixtures("llvmpipe")
def test_llvmpipe(found: dict[str, Any]) -> None:
    functions = found["built_ins"]
    assert all(functions[name]["ulp"] <= 0.501 for name in ("+", "-", "*", "/", "sqrt"))
    assert 0.6 < functions["inversesqrt"]["ulp"] <= 2
    assert 1e-4 < functions["acos"]["absolute"] < 1e-3, "this error is why no shader uses acos"
    assert found["fma"]["fused"] is False
    assert found["contracted"] == {"vertex": False, "fragment": False}
    assert found["precise"]["kept"] is True
    # Mesa 22 ends a loop after 65,535 rounds; Mesa 25 runs all that are tried. No loop of glshade is longer.
    rounds = found["loop_rounds"]
    assert rounds["tried"] >= rounds["fragment"] == rounds["vertex"] >= 65_535


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda function: function.name)
def test_arguments_fill_their_ranges(function: Any) -> None:
    arguments = function.arguments(np.random.default_rng(0))
    assert arguments.shape == (SIDE * SIDE, 2)
    for column, (low, high) in zip(arguments.T, function.ranges, strict=False):
        assert np.float32(low) <= column.min() < column.max() <= np.float32(high)
    if function.logarithmic:
        low, high = function.first
        assert np.median(arguments[:, 0]) == pytest.approx((low * high) ** 0.5, rel=1)
