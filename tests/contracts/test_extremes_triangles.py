"""Law: triangles of no area, needles and triangles smaller than a pixel leave no pixel that the reference does not explain."""

from __future__ import annotations

import numpy as np
import pytest
from explained import CAMERA, SUN, everywhere, scene, triangles

from glshade import Renderer

RANDOM = np.random.default_rng(1)
PLACES = RANDOM.uniform(-1, 1, (200, 1, 3))
SIDES = RANDOM.normal(size=(200, 3, 3))
SIDES /= np.linalg.norm(SIDES, axis=2, keepdims=True)


def test_of_no_area(renderer: Renderer) -> None:
    """Points, doubled corners and three in a row, beside triangles that are whole."""
    a, b = PLACES[:20, 0], PLACES[20:40, 0]
    corners = [
        np.stack([a, a, a], 1),
        np.stack([a, b, b], 1),
        np.stack([a, b, (a + b) / 2], 1),
        RANDOM.uniform(-1, 1, (5, 3, 3)),
    ]
    drawn, worst = everywhere(lambda m: scene(triangles(np.concatenate(corners), m), [SUN], camera=CAMERA), renderer)
    assert drawn > 50
    assert worst <= 5e-5  # measured 1.1e-6


@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-7, 1e-20])
def test_needles(width: float, renderer: Renderer) -> None:
    a, b = PLACES[:60, 0], PLACES[:60, 0] + SIDES[:60, 0]
    corners = np.stack([a, b, a + width * SIDES[:60, 1]], axis=1)
    everywhere(lambda m: scene(triangles(corners, m), [SUN], camera=CAMERA), renderer)


@pytest.mark.parametrize("size", [3e-2, 1e-2, 1e-3, 1e-5])
def test_smaller_than_a_pixel(size: float, renderer: Renderer) -> None:
    """A pixel is 0.06 wide."""
    everywhere(lambda m: scene(triangles(PLACES + size * SIDES, m), [SUN], camera=CAMERA), renderer)


def test_a_mesh_finer_than_the_picture(renderer: Renderer) -> None:
    ball = {"shape": {"type": "icosphere", "subdivisions": 5}}
    drawn, worst = everywhere(lambda m: scene({**ball, "material": m}, [SUN], (24, 24), camera=CAMERA), renderer)
    assert drawn > 150
    assert not worst > 5e-5  # measured 2.8e-6
