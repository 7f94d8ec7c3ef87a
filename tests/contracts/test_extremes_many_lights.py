"""Law: the light of many lamps is the sum of each, whether the program counts them, loops over a page, or adds up many pages.

llvmpipe stops loops of more than 65,535 rounds in one invocation without a word; the renderer asks for no more than a page.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from explained import scene

from glshade import Renderer
from glshade.glsl.generator import PAGE

CAMERA: dict[str, Any] = {"type": "orthographic", "eye": (0.0, 0.0, 1.0), "target": (0.0, 0.0, 0.0), "height": 1.0}


def sum_of(count: int, kind: str, renderer: Renderer, rate: Any) -> tuple[float, float, float]:
    """(drawn, float64 sum, sum of absolute values): one pixel of a white wall under `count` lamps, some of them negative."""
    random = np.random.default_rng(count)
    toward = random.normal(size=(count, 3))
    toward[:, 2] = np.abs(toward[:, 2]) + 0.1
    strength = random.uniform(-0.5, 1.5, count) / count
    wall = {"shape": "plane", "transform": {"rotate": (90, 0, 0), "scale": 4}, "material": {"brdf": "lambert", "kd": 1.0}}
    if kind == "directional":
        lamps = [
            {"type": kind, "direction": (-x, -y, -z), "intensity": s}
            for (x, y, z), s in zip(toward.tolist(), strength.tolist(), strict=True)
        ]
    else:
        lamps = [
            {"type": kind, "position": (x, y, z), "intensity": s, "falloff": "none"}
            for (x, y, z), s in zip(toward.tolist(), strength.tolist(), strict=True)
        ]
    pixels = renderer.render(scene(wall, lamps, (1, 1), camera=CAMERA), dtype="float32", shading=rate).pixels
    # What each lamp is given as: I pi and the unit direction, in float32. (At the pixel's centre, (0, 0, 0), a lamp's place is
    # its direction.)
    unit = (toward / np.linalg.norm(toward, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    each = (strength * math.pi).astype(np.float32).astype(np.float64) * unit[:, 2] / math.pi
    return float(pixels[0, 0, 0]), float(each.sum()), float(np.abs(each).sum())


def check(count: int, kind: str, renderer: Renderer, rate: Any) -> None:
    drawn, expected, absolute = sum_of(count, kind, renderer, rate)
    # A term is off by some 4 roundings; adding n terms in float32 rounds n times, sqrt(n) in effect, and once a page.
    terms = 4 * 2**-24 * absolute
    additions = 4 * 2**-24 * math.sqrt(count) * absolute / 2
    # Measured: 1e-7 at 1000 lamps, 3e-7 at 100,000. One lamp left out of 100,000 changes the sum by 5e-6 of it.
    assert abs(drawn - expected) <= terms + additions
    assert abs(drawn - expected) <= 2e-6 * max(1.0, absolute), "not one lamp in 100,000 may be missing"


@pytest.mark.parametrize("kind", ["directional", "point"])
@pytest.mark.parametrize("count", [1, 8, 9, PAGE, PAGE + 1, 1000])
def test_the_sum(count: int, kind: str, renderer: Renderer) -> None:
    check(count, kind, renderer, "phong")


@pytest.mark.parametrize("rate", ["gouraud", "flat"])
def test_the_sum_at_vertices_and_on_faces(rate: str, renderer: Renderer) -> None:
    check(1000, "directional", renderer, rate)


@pytest.mark.slow
@pytest.mark.parametrize("count", [65_535, 65_536, 100_000])
def test_more_than_a_loop_may_have(count: int, renderer: Renderer) -> None:
    check(count, "directional", renderer, "phong")
