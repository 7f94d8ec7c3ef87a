"""Property: turning the surface about its normal changes a model only if it declares itself anisotropic.

An anisotropic model becomes isotropic where its two widths are equal.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.extremes import at_extremes
from support.strategies import directions, materials

from glshade import BRDFS, Renderer, evaluate

ISOTROPIC = [name for name in BRDFS if not BRDFS[name].anisotropic]
ANISOTROPIC = [name for name in BRDFS if BRDFS[name].anisotropic]
STAGES = ["reference", "vertex", "fragment"]


def change(material: Any, angle: float, on: Any, renderer: Renderer) -> float:
    """Returns the change of f cos when both directions turn by `angle` [rad], relative to max(1, f cos)."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    l, v = directions(256, 1), directions(256, 2)
    before, after = (
        evaluate(material, l @ m.T, v @ m.T, on=on, context=renderer.context).astype(float) for m in (np.eye(3), turn)
    )
    return float(np.max(np.abs(after - before) / np.maximum(1, np.abs(before))))


# Turned directions are rounded to float32, with an error of 6e-8 each. A lobe of exponent p is steepest at the angle
# 1 / sqrt(p), where its relative slope is sqrt(p). So a lobe of exponent 1e4 multiplies the error by 100, and its peak may be
# about 100.
ROUNDING = 5e-5


def isotropic(material: Any) -> Any:
    """Returns the material with the parameters of `isotropic_where` set so that the tangents do not matter."""
    wanted = type(material).isotropic_where.items()
    return material.model_copy(update={name: getattr(material, x) if isinstance(x, str) else x for name, x in wanted})


@pytest.mark.parametrize("on", STAGES)
@pytest.mark.parametrize("name", ISOTROPIC)
@settings(max_examples=5)
@given(data=st.data(), angle=st.floats(-math.pi, math.pi))
def test_isotropic_models_do_not_see_the_tangent(name: str, on: Any, renderer: Renderer, data: Any, angle: float) -> None:
    assert change(data.draw(materials(name)), angle, on, renderer) <= ROUNDING


@pytest.mark.parametrize("on", STAGES)
@pytest.mark.parametrize("name", ANISOTROPIC)
@settings(max_examples=5)
@given(data=st.data(), angle=st.floats(-math.pi, math.pi))
def test_equal_widths_are_isotropic(name: str, on: Any, renderer: Renderer, data: Any, angle: float) -> None:
    assert change(isotropic(data.draw(materials(name))), angle, on, renderer) <= ROUNDING


@pytest.mark.parametrize("on", STAGES)
@pytest.mark.parametrize("name", ANISOTROPIC)
def test_unequal_widths_are_anisotropic(name: str, on: Any, renderer: Renderer) -> None:
    brushed = [material for material in at_extremes(name, 24) if material != isotropic(material)]
    assert max(change(material, math.pi / 3, on, renderer) for material in brushed) > 0.1


@pytest.mark.parametrize("name", ANISOTROPIC)
def test_half_a_turn_changes_nothing(name: str) -> None:
    """Tangents have no sign. The values are equal exactly, because half a turn only changes signs."""
    l, v = directions(256, 1), directions(256, 2)
    half = np.float32([-1, -1, 1])
    for material in at_extremes(name, 24):
        assert np.array_equal(evaluate(material, l, v), evaluate(material, l * half, v * half))
