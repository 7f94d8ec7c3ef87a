"""Property: the near plane clips triangles behind, across, in and at it, and around the eye, as it does in the reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.judge import BALL, CAMERA, SUN, judge_all, scene, triangles

from glshade import Renderer

# Interior pixels, relative to max(1, |c|). Measured: 1.2e-6.
WORST = 5e-5
AT_ONE: dict[str, Any] = {"eye": (0.0, 0.0, 1.0), "target": (0.0, 0.0, 0.0), "fov": 90, "near": 1.0, "far": 100.0}
AT_ORIGIN: dict[str, Any] = {"eye": (0.0, 0.0, 0.0), "target": (0.0, 0.0, -1.0), "fov": 90, "near": 1e-4, "far": 100.0}
WIDE: dict[str, Any] = {**CAMERA, "near": 1e-4, "far": 1e9}

# name -> corners, camera, and whether something must be seen; None where rounding decides, because the triangle lies in a
# plane.
CASES: dict[str, tuple[list[tuple[float, float, float]], dict[str, Any], bool | None]] = {
    "behind": ([(-1, -1, 6), (1, -1, 7), (0, 1, 8)], CAMERA, False),
    "across the near plane": ([(-3, -1, -2), (3, -1.5, -2), (0, -1, 9)], {**CAMERA, "near": 0.1, "far": 100.0}, True),
    "two corners behind the eye": ([(-30, -1, 20), (30, -1.5, 20), (0, -1, -20)], WIDE, True),
    "a corner in the near plane": ([(-1, -1, -2), (1, -1, -2), (0, 0.2, 0)], AT_ONE, True),
    "an edge in the near plane": ([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0, 0.5, -3)], AT_ONE, True),
    "in the near plane": ([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0, 0.5, 0)], AT_ONE, None),
    "in the far plane": ([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0, 0.5, 0)], {**AT_ONE, "near": 0.5, "far": 1.0}, None),
    "the eye in its plane": ([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], AT_ORIGIN, False),
    "a corner at the eye": ([(0, 0, 0), (1, -1, -1), (-1, -1, -1)], AT_ORIGIN, False),
    "an edge past the eye": ([(0, -1, 1), (0.2, -1, -3), (-0.2, 1, -1)], AT_ORIGIN, True),
    "from one horizon to the other": ([(-1e4, -1, -1e4), (1e4, -1, -1e4), (0, -1, 1e4)], CAMERA, True),
}


@pytest.mark.parametrize("case", CASES)
def test_cut_alike(case: str, renderer: Renderer) -> None:
    corners, camera, seen = CASES[case]
    drawn, worst = judge_all(lambda m: scene(triangles(corners, m), [SUN], camera=camera), renderer)
    assert not worst > WORST
    if seen is not None:
        assert (drawn > 20) if seen else drawn == 0


def test_from_inside(renderer: Renderer) -> None:
    lamp = {"type": "point", "position": (0.1, 0.2, 0.3), "falloff": "1/r^2"}
    drawn, worst = judge_all(lambda m: scene({**BALL, "material": m}, [lamp], camera={**AT_ORIGIN, "near": None}), renderer)
    assert drawn == 48 * 48
    assert worst <= WORST


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_near_1e_4_and_far_1e9(kind: str, renderer: Renderer) -> None:
    """Near objects hide far ones, although depths span 13 decades."""
    camera = {**{k: CAMERA[k] for k in ("eye", "target")}, "type": kind, "near": 1e-4, "far": 1e9}
    camera |= {"fov": 30} if kind == "perspective" else {"height": 3.0}
    # In the orthographic view the cube is only as large as the picture: clipping in float32 has no digits left for edges that
    # are 1e7 times as long.
    place = tuple(float(c) for c in -1e8 * np.array(CAMERA["eye"]) / np.linalg.norm(CAMERA["eye"]))
    beyond = {"shape": "cube", "transform": {"translate": place, "scale": 6e7 if kind == "perspective" else 1e3}}
    drawn, worst = judge_all(
        lambda m: scene([{**BALL, "material": m}, {**beyond, "material": m}], [SUN], camera=camera), renderer
    )
    assert drawn == 48 * 48
    assert worst <= WORST  # measured 2.0e-6
    assert np.isfinite(worst)
