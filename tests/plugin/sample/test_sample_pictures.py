"""Tests of a project that uses glshade's pytest plugin, and nothing else of glshade's own tests."""

from pathlib import Path

import numpy as np
import pytest

import glshade

BALL = Path(__file__).parent / "ball.toml"


def ball():
    return glshade.load(BALL, {"film.size": [32, 24]})


def test_a_scene_file(render_regression):
    render_regression.check(BALL)


def test_a_scene(render_regression):
    render_regression.check(ball(), name="balls/red")


@pytest.mark.glshade_compare
@pytest.mark.parametrize("value", [40, 80])
def test_a_returned_picture(value):
    return np.full((20, 30, 3), value, dtype=np.uint8)


class TestLayers:
    @pytest.mark.glshade_compare(rule="exact")
    def test_floats(self):
        return np.linspace(0, 1, 48, dtype=np.float32).reshape(4, 4, 3)


def test_the_same_picture_twice(render_regression):
    render_regression.same(ball(), ball())


def test_laws(render_regression):
    render_regression.laws(BALL)
