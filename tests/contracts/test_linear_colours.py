"""Property: a model is linear in the colours that it declares, and its channels do not depend on each other.

Spectra of linear colours are integrated before drawing; the others are drawn in bands, three to a vector.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.strategies import directions, materials

from glshade.brdfs import BRDFS, Brdf, parameter_values

LINEAR = [name for name in BRDFS if BRDFS[name].linear]
# The channels move one place to the right.
TURNED = [2, 0, 1]
COLOUR = st.tuples(*[st.floats(0, 1)] * 3)
# Two float64 evaluations of the same sum differ by a few roundings of terms that are about as large as the peak.
ROUNDING = 1e-11


def value(material: Brdf, colours: dict[str, Any]) -> np.ndarray:
    """Returns f cos (N, 3) and the ambient reflectance of a material with other colours."""
    values = {name: np.asarray(value, dtype=np.float64) for name, value in {**parameter_values(material), **colours}.items()}
    m = SimpleNamespace(**values, **material.chosen(), **material.data())
    l, v = directions(64, 3), directions(64, 4)
    light = type(material).brdf_cos(m, l, v)
    return np.concatenate([light, np.broadcast_to(type(material).ambient_reflectance(m), light.shape)])


def greyed(material: Brdf) -> dict[str, Any]:
    """Returns the colours of a material, each equal in all channels."""
    values = parameter_values(material)
    return {name: np.full(3, values[name][0]) for name in values if material.is_colour(name)}


def test_most_models_are_linear_in_some_colour() -> None:
    assert len(LINEAR) >= 15
    for name in LINEAR:
        assert all(BRDFS[name].is_colour(colour) for colour in BRDFS[name].linear)


@pytest.mark.parametrize("name", LINEAR)
@settings(max_examples=6)
@given(st.data(), st.floats(0, 1))
def test_a_mixture_of_colours_gives_the_mixture_of_lights(name: str, data: st.DataObject, share: float) -> None:
    material = data.draw(materials(name))
    linear = material.linear_colours()
    first, second = ({colour: np.array(data.draw(COLOUR)) for colour in linear} for _ in range(2))
    grey = greyed(material)
    mixture = {colour: share * first[colour] + (1 - share) * second[colour] for colour in linear}
    mixed = value(material, grey | mixture)
    expected = share * value(material, grey | first) + (1 - share) * value(material, grey | second)
    np.testing.assert_allclose(mixed, expected, atol=ROUNDING * max(1.0, float(np.abs(expected).max())), rtol=1e-9)


@pytest.mark.parametrize("name", BRDFS)
@settings(max_examples=6)
@given(st.data())
def test_channels_do_not_mix_unless_it_is_said(name: str, data: st.DataObject) -> None:
    material = data.draw(materials(name))
    if material.mixes_channels or material.tables:
        return
    values = parameter_values(material)
    turned = {name: np.asarray(values[name])[TURNED] for name in values if material.is_colour(name)}
    np.testing.assert_allclose(value(material, turned), value(material, {})[:, TURNED], rtol=1e-12, atol=0)


def test_a_tint_mixes_channels() -> None:
    tinted = BRDFS["principled"](kd=(0.9, 0.4, 0.1), sheen=1.0, sheen_tint=1.0)
    assert tinted.mixes_channels
    assert not tinted.linear_colours()
    assert not BRDFS["principled"](kd=(0.9, 0.4, 0.1)).mixes_channels


def test_half_a_metal_is_not_linear() -> None:
    """The law would fail: kd is in the Fresnel term that dims kd."""
    half = BRDFS["ggx"](metallic=0.5)
    assert half.linear_colours() == ()
    dark, bright = ({"kd": np.full(3, x)} for x in (0.1, 0.9))
    middle = value(half, {"kd": np.full(3, 0.5)})
    assert np.abs(middle - (value(half, dark) + value(half, bright)) / 2).max() > 1e-4
