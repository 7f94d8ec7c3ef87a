"""Property: f cos is finite and never negative, at ordinary and at extreme parameters, in Python and in both stages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.extremes import at_extremes, spread
from support.strategies import directions, materials

from glshade import BRDFS, Renderer, evaluate
from glshade.brdfs import Brdf


def all_pairs() -> tuple[Any, Any]:
    """Returns l and v: every pair of some directions, with the mirror direction of each and directions near it."""
    l = directions(48, 1)
    v = np.concatenate([l, l * np.float32([-1, -1, 1]), directions(24, 2), directions(24, 3, below=True)])
    return l[:, None, :], v[None, :, :]


@pytest.mark.parametrize("on", ["reference", "vertex", "fragment"])
@pytest.mark.parametrize("name", BRDFS)
def test_at_the_ends_of_every_range(name: str, on: Any, renderer: Renderer) -> None:
    check(spread(at_extremes(name, 48), 16), on, renderer)


@pytest.mark.slow
@pytest.mark.parametrize("on", ["reference", "vertex", "fragment"])
@pytest.mark.parametrize("name", BRDFS)
def test_at_all_ends_of_every_range(name: str, on: Any, renderer: Renderer) -> None:
    check(at_extremes(name, 48), on, renderer)


def check(found: list[Brdf], on: Any, renderer: Renderer) -> None:
    l, v = all_pairs()
    for material in found:
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
    """A model that is 0 everywhere would pass every test here. Only a model that uses nothing but ambient light may be 0."""
    only_ambient = not BRDFS[name]().asked("light")
    assert (evaluate(BRDFS[name](), *all_pairs()).max() > 0) is not only_ambient
