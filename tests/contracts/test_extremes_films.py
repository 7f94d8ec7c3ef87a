"""Property: a picture of one pixel, of one column, or of three rows wider than any texture is what the reference allows."""

from __future__ import annotations

import numpy as np
import pytest
from support.judge import BALL, MATERIALS, RATES, SUN, judge, scene

from glshade import Renderer

# size [pixels] -> fov [degrees]: the sphere fills the short side and extends along the long one.
FILMS = {(1, 1): 20.0, (1, 16384): 175.0, (16385, 3): 1.0}


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("size", FILMS, ids=str)
def test_the_reference_allows_every_pixel(size: tuple[int, int], rate: str, renderer: Renderer) -> None:
    camera = {"eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "fov": FILMS[size]}
    for material in MATERIALS.values():
        found = judge(scene({**BALL, "material": material}, [SUN], size, camera=camera), renderer, rate)  # type: ignore[arg-type]
        assert found.pixels.shape == (size[1], size[0], 4)
        assert found.drawn == 1 if size == (1, 1) else found.drawn > 100
        # Measured: 1.5e-4, where a triangle is thousands of pixels wide.
        assert not found.worst > 5e-4


@pytest.mark.parametrize("size", FILMS, ids=str)
def test_eight_bits(size: tuple[int, int], renderer: Renderer) -> None:
    camera = {"eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "fov": FILMS[size]}
    pixels = renderer.render(scene(BALL, [SUN], size, camera=camera)).pixels
    assert pixels.shape == (size[1], size[0], 3)
    assert pixels.dtype == np.uint8
    assert pixels.max() > 50
