"""Property: f(l, v) = f(v, l) (Helmholtz reciprocity). A model that declares that it lacks this property must lack it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.strategies import directions, materials

from glshade import BRDFS, evaluate

KEPT = [name for name in BRDFS if "reciprocity" not in BRDFS[name].breaks]
BROKEN = [name for name in BRDFS if "reciprocity" in BRDFS[name].breaks]


def asymmetry(material: Any) -> float:
    """Returns the largest difference of f(l, v) and f(v, l), relative to the larger, away from grazing angles."""
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
    # Directions are float32, so n.l and n.v have errors of 6e-8, which is about 1e-6 of a cosine of 0.05.
    assert asymmetry(data.draw(materials(name))) <= 1e-5


@pytest.mark.parametrize("name", BROKEN)
@settings(max_examples=1, derandomize=True)
@given(data=st.data())
def test_a_declared_exception_breaks_the_law(name: str, data: Any) -> None:
    assert len(BRDFS[name].breaks["reciprocity"]) > 10, "the reason"
    assert max(asymmetry(BRDFS[name]()), asymmetry(data.draw(materials(name)))) > 1e-3
