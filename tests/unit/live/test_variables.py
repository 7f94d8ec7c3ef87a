"""Pictures of variables, and the tables of a pixel's steps."""

from __future__ import annotations

import numpy as np

from glshade.debug.tracing import TracedStep
from glshade.live.variables import MOST_STEPS, NOT_FINITE, step_tables, variable_picture
from glshade.page.ramp import RAMP

ALL = np.ones((1, 3), np.bool_)


def test_a_number_is_shown_on_the_scale_from_its_least_to_its_greatest_value() -> None:
    picture, scale = variable_picture(np.array([[[-2.0], [3.0], [8.0]]]), "x", np.array([[True, True, False]]))
    assert (scale["low"], scale["high"], scale["text"]) == (-2, 3, "x, float64")
    assert picture[0, 0].tolist() == [*RAMP[0], 255]
    assert picture[0, 1].tolist() == [*RAMP[-1], 255]
    assert picture[0, 2, 3] == 0
    assert scale["colours"][0] == "#080a12"


def test_the_components_of_a_vector_are_red_green_and_blue() -> None:
    picture, scale = variable_picture(np.array([[[-1.0, 0, 1], [1, 1, 1], [0, 0, 0]]]), "n", ALL)
    assert picture[0, :, :3].tolist() == [[0, 128, 255], [255, 255, 255], [128, 128, 128]]
    assert scale["colours"] == ["#000000", "#ffffff"]
    two, _ = variable_picture(np.array([[[0.0, 1], [1, 0], [1, 1]]]), "uv", ALL)
    assert two[0, :, :3].tolist() == [[0, 255, 0], [255, 0, 0], [255, 255, 0]]


def test_what_is_not_finite_has_a_colour_of_its_own_and_does_not_stretch_the_scale() -> None:
    picture, scale = variable_picture(np.array([[[np.nan], [np.inf], [0.5]]]), "x", ALL)
    assert picture[0, :2].tolist() == [[*NOT_FINITE, 255]] * 2
    assert (scale["low"], scale["high"]) == (0.5, 0.5)
    nothing, scale = variable_picture(np.full((1, 3, 1), np.nan), "x", ALL)
    assert nothing[0].tolist() == [[*NOT_FINITE, 255]] * 3
    assert (scale["low"], scale["high"]) == (0, 0)


def test_steps_are_counted_and_a_long_list_is_cut() -> None:
    step = TracedStep("/shaders/math/unit.glsl:6", "return x;", "unit", "return", "float", np.float64(0.1), np.float32(0.1))
    tables = step_tables([step] * (MOST_STEPS + 5))
    assert len(tables) == MOST_STEPS
    assert [table["number"] for table in tables[:3]] == [0, 1, 2]
    first = tables[0]
    assert (first["file"], first["short"], first["line"]) == ("/shaders/math/unit.glsl", "math/unit.glsl", 6)
    assert (first["float64"], first["float32"], first["picture"]) == ("0.1", "0.100000001", True)
