"""Pictures by the reference that are made to be baselines: they are right, and near to what a driver draws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glshade import Renderer, Scene, verify
from glshade.golden.reference_picture import render_film
from glshade.reference.picture import render

# A cube before a plane, with outlines against the plane and against the background.
OBJECTS = [
    {"shape": "cube", "material": {"brdf": "phong", "kd": 0.5, "ks": 0.3, "exponent": 8}},
    {
        "shape": "plane",
        "transform": {"translate": [0, -0.5, 0], "scale": 1.2},
        "material": {"brdf": "lambert", "kd": [0.6, 0.3, 0.2]},
    },
]


def scene(**film: Any) -> Scene:
    camera = {"eye": [0.4, 1.3, 3.5], "target": [0, 0, 0]}
    return Scene.model_validate({"objects": OBJECTS, "camera": camera, "film": {"size": [32, 24], **film}})


def test_one_sample_is_the_picture_of_the_reference() -> None:
    assert np.array_equal(render_film(scene()).pixels, render(scene()).pixels)


@pytest.mark.parametrize(
    "film",
    [
        {"samples": 4, "background": [0.1, 0.2, 0.3, 0.5]},
        {"supersample": 2},
        pytest.param({"samples": 8}, marks=pytest.mark.slow),
        pytest.param({"samples": 4, "supersample": 2}, marks=pytest.mark.slow),
    ],
)
def test_several_samples(renderer: Renderer, film: Any) -> None:
    drawn = renderer.render(scene(**film), dtype="float32").pixels.copy()
    made = render_film(scene(**film))
    assert made.pixels.shape == drawn.shape
    assert verify(scene(**film), picture=made).comparison.unexplained == 0
    # A driver decides some samples at outlines differently.
    difference = np.abs(made.pixels - drawn).max(axis=2)
    assert np.mean(difference > 2 / 255) < 0.03
    smoothed = np.abs(made.pixels - render_film(scene(background=film.get("background", [0.0] * 3))).pixels).max(axis=2)
    assert np.mean(smoothed > 2 / 255) > 0.05, "the picture has outlines, and they are smoothed"


def test_a_crop_is_a_part_of_the_whole_picture() -> None:
    whole, part = render_film(scene(samples=4)), render_film(scene(samples=4, crop=[5, 3, 20, 11]))
    assert np.array_equal(part.pixels, whole.pixels[3:14, 5:25])
    assert (part.corner, part.whole) == ((5, 3), (32, 24))
