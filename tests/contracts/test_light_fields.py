"""Property: the GLSL struct of a light has the fields of the Python class's `uniforms`, in the same order and types."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.strategies import lights
from test_parameters_agree import struct_fields

from glshade import LIGHTS
from glshade.lights import Light


def a_light(name: str) -> Light:
    placed = {"position": (0, 0, 0)} if "position" in LIGHTS[name].model_fields else {}
    return LIGHTS[name](**placed)


@pytest.mark.parametrize("name", LIGHTS)
def test_the_struct_has_the_uniforms(name: str) -> None:
    kinds = {3: "vec3", 1: "float"}
    given = [(kinds[np.size(value)], field) for field, value in a_light(name).uniforms(np.zeros(3)).items()]
    assert struct_fields(f"light/{name}.glsl", LIGHTS.class_name(name)) == given


@pytest.mark.parametrize("name", LIGHTS)
@given(data=st.data())
def test_the_uniforms_are_finite(name: str, data: Any) -> None:
    light = LIGHTS[name].model_validate(data.draw(lights(name)))
    for field, value in light.uniforms(np.array([1.0, 2.0, 3.0])).items():
        assert np.all(np.isfinite(value)), field


@pytest.mark.parametrize("name", LIGHTS)
def test_positions_are_relative_to_the_eye(name: str) -> None:
    """Far from the origin a float32 position has too few digits; its difference from the eye has enough."""
    if "position" not in LIGHTS[name].model_fields:
        here, there = (a_light(name).uniforms(np.full(3, x)) for x in (0.0, 1e7))
        # Such a light may still have a coordinate of a place, a height for example.
        assert all(np.isin(np.subtract(here[field], there[field]), (0.0, 1e7)).all() for field in here)
        return
    light = LIGHTS[name](position=(1e7, 0.0, 0.25))
    assert light.uniforms(np.array([1e7, 0.0, 0.0]))["position"] == pytest.approx([0, 0, 0.25], abs=0)
