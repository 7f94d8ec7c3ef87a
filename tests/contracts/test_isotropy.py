"""Law: a model that does not declare itself anisotropic is the same however the surface is turned about its normal;
one that does is not, and becomes so where its two widths are equal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import directions, materials

from glshade import BRDFS, Renderer, evaluate

# The parameters that differ between the tangent directions, by model.
WIDTHS = {"ashikhmin_shirley": ("pu", "pv")}
ISOTROPIC = [name for name in BRDFS if not BRDFS[name].anisotropic]
ANISOTROPIC = [name for name in BRDFS if BRDFS[name].anisotropic]
STAGES = ["reference", "vertex", "fragment"]


def change(material: Any, angle: float, on: Any, renderer: Renderer) -> float:
    """How much f cos changes when both directions turn by `angle` [rad], relative to max(1, f cos)."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    l, v = directions(256, 1), directions(256, 2)
    before, after = (
        evaluate(material, l @ m.T, v @ m.T, on=on, context=renderer.context).astype(float) for m in (np.eye(3), turn)
    )
    return float(np.max(np.abs(after - before) / np.maximum(1, np.abs(before))))


# Turned directions are rounded to float32, 6e-8 each; a lobe of exponent 1e4 at the edge of its slope (at an angle of
# 1 / sqrt(p), of slope sqrt(p)) makes 100 times that of it, and its peak may be 100 or so above 1.
ROUNDING = 5e-5


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
    material = data.draw(materials(name))
    one, other = WIDTHS[name]
    assert change(material.model_copy(update={other: getattr(material, one)}), angle, on, renderer) <= ROUNDING


@pytest.mark.parametrize("on", STAGES)
@pytest.mark.parametrize("name", ANISOTROPIC)
def test_unequal_widths_are_not(name: str, on: Any, renderer: Renderer) -> None:
    one, other = WIDTHS[name]
    brushed = BRDFS[name](**{one: 10, other: 1000})
    assert change(brushed, math.pi / 2, on, renderer) > 0.1
    # Turned by a quarter it is the model with its widths exchanged.
    l, v = directions(64, 1), directions(64, 2)
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], dtype=np.float32)
    swapped = BRDFS[name](**{one: 1000, other: 10})
    turned = evaluate(brushed, l @ quarter.T, v @ quarter.T, on=on, context=renderer.context)
    assert turned == pytest.approx(evaluate(swapped, l, v, on=on, context=renderer.context), rel=1e-5, abs=1e-6)
