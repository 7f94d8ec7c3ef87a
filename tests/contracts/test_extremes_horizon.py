"""Property: a model is exactly 0 if the light or the viewer is in the horizon or barely below it, and finite above it."""

from __future__ import annotations

import numpy as np
import pytest
from support.extremes import STAGES, at_extremes, joined, measured, pairs, spread

from glshade import BRDFS, Renderer, evaluate


@pytest.mark.parametrize("name", BRDFS)
def test_nothing_from_below(name: str, renderer: Renderer) -> None:
    l, v, case = joined(pairs())
    below = (l[:, 2] <= 0) | (v[:, 2] <= 0)
    assert below.sum() > 500
    assert np.unique(case[below]).size > 8
    for material in spread(at_extremes(name, 24), 24):
        assert np.all(evaluate(material, l[below], v[below]) == 0)
        for stage in STAGES:
            gpu = measured(material, stage, renderer, l, v)
            assert np.all(gpu[below] == 0), f"{material!r} in the {stage} stage"
            assert gpu.min() >= 0


@pytest.mark.parametrize("name", BRDFS)
def test_nothing_where_there_is_no_direction(name: str, renderer: Renderer) -> None:
    """A light at the surface itself has l = 0, and a surface without a normal has n.v = 0. Both give 0 and never NaN."""
    some = np.float32([[0, 0, 1], [0.6, 0, 0.8], [0, 0, 0]])
    none = np.zeros((3, 3), dtype=np.float32)
    for material in spread(at_extremes(name, 24), 24):
        for stage in STAGES:
            for l, v in ((none, some), (some, none)):
                assert np.all(measured(material, stage, renderer, l, v) == 0), f"{material!r} in the {stage} stage"
