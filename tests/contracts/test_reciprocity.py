"""Law: light may be turned round: f(l, v) = f(v, l). A model that says it breaks this must break it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import directions, materials

from glshade import BRDFS, evaluate

KEPT = [name for name in BRDFS if "reciprocity" not in BRDFS[name].breaks]
BROKEN = [name for name in BRDFS if "reciprocity" in BRDFS[name].breaks]


def asymmetry(material: Any) -> float:
    """The largest difference of f(l, v) and f(v, l), relative to the larger, away from grazing angles."""
    l, v = (directions(64, seed) for seed in (1, 2))
    l, v = (d[d[:, 2] > 0.05].astype(np.float64) for d in (l, v))
    l, v = np.broadcast_arrays(l[:, None], v[None])
    there = evaluate(material, l, v) / l[..., 2:]
    back = evaluate(material, v, l) / v[..., 2:]
    return float(np.max(np.abs(there - back) / np.maximum(np.maximum(there, back), 1e-3)))


@pytest.mark.parametrize("name", KEPT)
@settings(max_examples=25)
@given(data=st.data())
def test_reciprocal(name: str, data: Any) -> None:
    # Directions are float32: n.l and n.v carry 6e-8, at a cosine of 0.05 that is 1e-6 of it.
    assert asymmetry(data.draw(materials(name))) <= 1e-5


@pytest.mark.parametrize("name", BROKEN)
@settings(max_examples=1, derandomize=True)
@given(data=st.data())
def test_what_breaks_it_does(name: str, data: Any) -> None:
    assert len(BRDFS[name].breaks["reciprocity"]) > 10, "the reason"
    assert max(asymmetry(BRDFS[name]()), asymmetry(data.draw(materials(name)))) > 1e-3
