"""Law: f cos is finite and never negative, at ordinary parameters and at the ends of every range, wherever it is evaluated."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from extremes import at_extremes
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import directions, materials

from glshade import BRDFS, Renderer, evaluate


def all_pairs() -> tuple[Any, Any]:
    """Every direction against every other, with the mirror direction of each and near misses of it."""
    l = directions(48, 1)
    v = np.concatenate([l, l * np.float32([-1, -1, 1]), directions(24, 2), directions(24, 3, below=True)])
    return l[:, None, :], v[None, :, :]


@pytest.mark.parametrize("on", ["reference", "vertex", "fragment"])
@pytest.mark.parametrize("name", BRDFS)
def test_at_the_ends_of_every_range(name: str, on: Any, renderer: Renderer) -> None:
    l, v = all_pairs()
    for material in at_extremes(name, 48):
        value = evaluate(material, l, v, on=on, context=renderer.context)
        assert np.all(np.isfinite(value)), material
        assert value.min() >= 0, material


@pytest.mark.parametrize("name", BRDFS)
@settings(max_examples=25)
@given(data=st.data())
def test_at_ordinary_parameters(name: str, data: Any) -> None:
    value = evaluate(data.draw(materials(name)), *all_pairs())
    assert np.all(np.isfinite(value))
    assert value.min() >= 0


@pytest.mark.parametrize("on", ["reference", "vertex", "fragment"])
@pytest.mark.parametrize("name", BRDFS)
def test_where_light_and_viewer_are_opposite(name: str, on: Any, renderer: Renderer) -> None:
    """l = -v has no half vector; both lie in the horizon, or one is below it."""
    l = np.concatenate([directions(64, 4), [[1, 0, 0], [0, 1, 0], [0, -1, 0]]])
    value = evaluate(BRDFS[name](), l, -l, on=on, context=renderer.context)
    assert np.all(value == 0)


@pytest.mark.parametrize("name", BRDFS)
def test_it_says_something(name: str) -> None:
    """A model that is zero everywhere would pass every law here; only one that answers to ambient light alone may be."""
    only_ambient = not BRDFS[name]().asked("light")
    assert (evaluate(BRDFS[name](), *all_pairs()).max() > 0) is not only_ambient
