"""Pixels: the variables of the programs that shade a scene's pixels, and the lines that lose digits there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.texts import needs_compiler

from glshade import Scene, trace_pixel
from glshade.debug.pixels import Pixels, Variable
from glshade.errors import SceneError
from glshade.glsl.shaders import current
from glshade.reference.picture import radiance

pytestmark = needs_compiler
SIZE = (24, 16)


def scene(shading: str = "phong", **material: Any) -> Scene:
    """Returns a scene of one sphere in front of a black background, with an ambient and a directed light."""
    return Scene.model_validate(
        {
            "film": {"size": SIZE},
            "camera": {"eye": (0, 0, 4), "target": (0, 0, 0)},
            "materials": {"red": {"brdf": "phong", "kd": (0.6, 0.3, 0.1), "ks": 0.3, "exponent": 20} | material},
            "objects": [
                {"name": "far", "shape": "sphere", "material": "red", "transform": {"translate": (0, 0, -50)}},
                {"name": "ball", "shape": "sphere", "material": "red", "shading": shading},
            ],
            "lights": [{"type": "directional", "direction": (-1, -1, -2)}, {"type": "ambient", "intensity": 0.1}],
        }
    )


@pytest.mark.parametrize("shading", ["flat", "phong"])
def test_the_output_of_the_stage_is_the_light_of_the_pixel(shading: str) -> None:
    expected = radiance(scene(shading))[6, 14, :3]
    trace = trace_pixel(scene(shading), 14, 6)
    assert (trace.object, trace.number) == ("ball", 1)
    found = [step for step in trace.steps if step.name in ("o_colour", "v_radiance")][-1]
    np.testing.assert_allclose(found.float64[:3], expected, rtol=1e-6)
    assert found.float32 == pytest.approx(found.float64, rel=1e-5)
    assert found.vertex is None
    assert 0 <= found.digits < 2
    assert "vertex stage" not in str(trace)
    assert str(trace).splitlines()[0].split() == ["line", "variable", "float64", "float32", "text"]


def test_gouraud_shows_the_nearest_corner() -> None:
    trace = trace_pixel(scene("gouraud"), 14, 6)
    (position,) = {tuple(step.float64) for step in trace.steps if step.name == "p"}
    exact = trace_pixel(scene("phong"), 14, 6)
    (at_pixel,) = {tuple(step.float64) for step in exact.steps if step.name == "p"}
    distance = float(np.linalg.norm(np.subtract(position, at_pixel)))
    assert 0 < distance < 0.1, "the edges of the sphere's triangles are shorter than that"


def test_the_background_has_no_steps_and_a_pixel_must_lie_in_the_picture() -> None:
    trace = trace_pixel(scene(), 0, 0)
    assert (trace.object, trace.number, trace.steps) == (None, -1, ())
    with pytest.raises(SceneError, match="the pixel 24, 0 lies outside the picture, which is 24 x 16"):
        trace_pixel(scene(), 24, 0)


@pytest.mark.parametrize("shading", ["gouraud", "phong"])
def test_a_variable_has_in_its_picture_the_value_of_the_trace(shading: str) -> None:
    pixels = Pixels(scene(shading), current())
    trace = pixels.trace(14, 6)
    times: dict[tuple[str, str], int] = {}
    compared = 0
    for step in trace.steps:
        number = times.get((step.place, step.name), 0)
        times[step.place, step.name] = number + 1
        if step.type not in ("float", "vec3"):
            continue
        values, present = pixels.values(1, Variable(step.place, step.name, number))
        assert values.shape[:2] == present.shape == (SIZE[1], SIZE[0])
        assert present[6, 14]
        assert not present[0, 0]
        np.testing.assert_allclose(values[6, 14], np.atleast_1d(step.float64), rtol=1e-12)
        compared += 1
    assert compared > 20
    with pytest.raises(SceneError, match=r"nowhere:1: no visible program gives x a number or a vector there"):
        pixels.values(1, Variable("nowhere:1", "x"))


def test_an_object_that_is_not_seen_loses_no_digits() -> None:
    pixels = Pixels(scene(), current())
    assert pixels.digits(0).lines == ()
    assert {loss.place.rpartition("/")[2].partition(":")[0] for loss in pixels.digits(1).lines} >= {"phong.glsl", "unit.glsl"}
