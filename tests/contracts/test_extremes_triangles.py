"""Property: triangles of no area, needles and triangles smaller than a pixel are drawn as the reference allows."""

from __future__ import annotations

import numpy as np
import pytest
from support.judge import CAMERA, SUN, judge_all, scene, triangles

from glshade import Renderer

RANDOM = np.random.default_rng(1)
PLACES = RANDOM.uniform(-1, 1, (200, 1, 3))
SIDES = RANDOM.normal(size=(200, 3, 3))
SIDES /= np.linalg.norm(SIDES, axis=2, keepdims=True)


def test_of_no_area(renderer: Renderer) -> None:
    """The triangles are points, have two equal corners, or have three corners in a row. Whole triangles lie beside them."""
    a, b = PLACES[:20, 0], PLACES[20:40, 0]
    corners = [
        np.stack([a, a, a], 1),
        np.stack([a, b, b], 1),
        np.stack([a, b, (a + b) / 2], 1),
        RANDOM.uniform(-1, 1, (5, 3, 3)),
    ]
    drawn, worst = judge_all(lambda m: scene(triangles(np.concatenate(corners), m), [SUN], camera=CAMERA), renderer)
    assert drawn > 50
    assert worst <= 5e-5  # measured 1.1e-6


# The narrower a triangle, the fewer pixel centres it covers: width -> the pixels that 60 needles draw at least.
NEEDLES = {1e-2: 40, 1e-4: 1, 1e-7: 0, 1e-20: 0}


@pytest.mark.parametrize("width", NEEDLES)
def test_needles(width: float, renderer: Renderer) -> None:
    a, b = PLACES[:60, 0], PLACES[:60, 0] + SIDES[:60, 0]
    corners = np.stack([a, b, a + width * SIDES[:60, 1]], axis=1)
    drawn, worst = judge_all(lambda m: scene(triangles(corners, m), [SUN], camera=CAMERA), renderer)
    assert drawn >= NEEDLES[width]
    # worst is NaN if no pixel has a certain fragment.
    assert not worst > 5e-5  # measured 4.4e-7


# size -> the pixels that 200 triangles draw at least. A pixel is 0.06 wide.
SMALL = {3e-2: 10, 1e-2: 1, 1e-3: 0, 1e-5: 0}


@pytest.mark.parametrize("size", SMALL)
def test_smaller_than_a_pixel(size: float, renderer: Renderer) -> None:
    drawn, worst = judge_all(lambda m: scene(triangles(PLACES + size * SIDES, m), [SUN], camera=CAMERA), renderer)
    assert drawn >= SMALL[size]
    assert not worst > 5e-5  # measured 8.7e-7


def test_a_mesh_finer_than_the_picture(renderer: Renderer) -> None:
    ball = {"shape": {"type": "icosphere", "subdivisions": 5}}
    drawn, worst = judge_all(lambda m: scene({**ball, "material": m}, [SUN], (24, 24), camera=CAMERA), renderer)
    assert drawn > 150
    assert not worst > 5e-5  # measured 2.8e-6
