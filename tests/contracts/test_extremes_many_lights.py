"""Property: the light of many lamps is their sum, whether the program unrolls them, loops over a page, or adds up many pages.

llvmpipe silently ends a loop after 65,535 rounds; the renderer never asks for more rounds than a page has.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from support.judge import scene

from glshade import LIGHTS, Renderer
from glshade.glsl.generator import PAGE

CAMERA: dict[str, Any] = {"type": "orthographic", "eye": (0.0, 0.0, 1.0), "target": (0.0, 0.0, 0.0), "height": 1.0}


def lamp(kind: str, place: list[float], intensity: float) -> dict[str, Any]:
    """Returns a light that shines from a place towards the origin without falloff, or along that direction from infinity."""
    fields = LIGHTS[kind].model_fields
    found: dict[str, Any] = {"type": kind, "intensity": intensity}
    if "direction" in fields:
        found["direction"] = [-x for x in place]
    if "position" in fields:
        found |= {"position": place, "falloff": "none"}
    return found


def sum_of(count: int, kind: str, renderer: Renderer, rate: Any) -> tuple[float, float, float]:
    """Returns (drawn, float64 sum, sum of absolute values) for one pixel of a white wall under `count` lamps, some negative."""
    random = np.random.default_rng(count)
    toward = random.normal(size=(count, 3))
    toward[:, 2] = np.abs(toward[:, 2]) + 0.1
    strength = random.uniform(-0.5, 1.5, count) / count
    wall = {"shape": "plane", "transform": {"rotate": (90, 0, 0), "scale": 4}, "material": {"brdf": "lambert", "kd": 1.0}}
    lamps = [lamp(kind, place, intensity) for place, intensity in zip(toward.tolist(), strength.tolist(), strict=True)]
    pixels = renderer.render(scene(wall, lamps, (1, 1), camera=CAMERA), dtype="float32", shading=rate).pixels
    # The GPU gets each lamp as its intensity times pi and its unit direction, in float32. The pixel's centre is at (0, 0, 0),
    # so the direction to a lamp is its normalised place.
    unit = (toward / np.linalg.norm(toward, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    each = (strength * math.pi).astype(np.float32).astype(np.float64) * unit[:, 2] / math.pi
    return float(pixels[0, 0, 0]), float(each.sum()), float(np.abs(each).sum())


def check(count: int, kind: str, renderer: Renderer, rate: Any) -> None:
    drawn, expected, absolute = sum_of(count, kind, renderer, rate)
    # The error of a term is about 4 roundings. Adding n terms in float32 rounds n times, which adds up to about sqrt(n)
    # roundings, and once more for each page.
    terms = 4 * 2**-24 * absolute
    additions = 4 * 2**-24 * math.sqrt(count) * absolute / 2
    # Measured: 1e-7 at 1000 lamps, 3e-7 at 100,000. One lamp left out of 100,000 changes the sum by 5e-6 of it.
    assert abs(drawn - expected) <= terms + additions
    assert abs(drawn - expected) <= 2e-6 * max(1.0, absolute), "not one lamp in 100,000 may be missing"


# The lights that shine from a place, or along a direction.
AIMED = [name for name, model in LIGHTS.items() if {"position", "direction"} & set(model.model_fields)]


@pytest.mark.parametrize("kind", AIMED)
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
