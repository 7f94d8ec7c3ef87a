"""Bounds: the intervals hold where a driver's float32 arithmetic is worst, and stay narrow elsewhere.

Most tests here compare the GPU's picture of a scene that is hard to interpolate with the reference's intervals.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from glshade import Renderer, Scene, verify
from glshade.radiance.surface import at_vertices, evaluate_surface, material_of
from glshade.reference import bounds
from glshade.reference.inputs import prepare
from glshade.verification.candidates import find_candidates
from glshade.verification.judgement import PixelClass

RATES = ("flat", "gouraud", "phong")
SHINY = {"brdf": "phong", "kd": (0.6, 0.5, 0.4), "ks": 0.3, "exponent": 30.0}
POINT = {"type": "point", "position": (1.776, 1.804, 2.609), "intensity": 8.0}


def view(shape: Any, size: tuple[int, int] = (240, 180), light: Any = POINT, **thing: Any) -> Scene:
    camera = {"eye": (1.2, 1.5, 3.5), "target": (0.0, 0.0, 0.0), "fov": 40}
    item = {"shape": shape, "material": SHINY, **thing}
    return Scene.model_validate({"film": {"size": size}, "camera": camera, "objects": [item], "lights": [light]})


def width(scene: Scene) -> Any:
    """Returns the largest width of a channel's interval, for each candidate (N,)."""
    expected = find_candidates(scene).expected
    return (expected.high - expected.low).max(axis=1)


# Slivers.


def over_the_border(size: tuple[int, int] = (480, 360)) -> Scene:
    """Returns a cube with one corner 0.6 pixels above the picture's upper edge, where the driver's clipping makes a sliver."""
    return Scene.model_validate(
        {
            "film": {"size": size},
            "camera": {"eye": (-1.592, 0.082, -2.935), "target": (0, 0, 0), "fov": 36.4740626464227},
            "objects": [
                {
                    "shape": "cube",
                    "transform": {"rotate": (-8.9, 102.4, 167.3), "scale": (0.75, 0.64, 1.24)},
                    "material": {"brdf": "lambert", "kd": 0.8},
                }
            ],
            "lights": [{"type": "point", "position": (1.776, -1.804, -1.609), "intensity": 8}],
        }
    )


def test_a_sliver_at_the_border_is_verified(renderer: Renderer) -> None:
    assert str(verify(over_the_border(), renderer=renderer)).startswith("verified: 0 pixels")


def test_only_slivers_have_wide_intervals() -> None:
    widths = width(over_the_border())
    assert np.median(widths) < 1e-5
    assert 1e-5 < np.quantile(widths, 0.999) < 1e-3


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("kind", ["cylinder", "cone"])
def test_needles_are_verified(kind: str, rate: Any, renderer: Renderer) -> None:
    verdict = verify(view({"type": kind, "segments": 4096}), renderer=renderer, shading=rate)
    assert verdict.verdict == "verified", str(verdict)


@pytest.mark.parametrize("rate", ["gouraud", "phong"])
def test_a_fan_of_needles_has_room_to_spare(rate: Any, renderer: Renderer) -> None:
    count = 10_000
    angle = np.arange(count) * 2 * np.pi / count
    corners = np.concatenate([np.zeros((1, 3)), np.column_stack([np.cos(angle), np.sin(angle), np.full(count, 0.1)])])
    number = np.arange(count)
    faces = np.column_stack([np.zeros(count, dtype=np.intp), 1 + number, 1 + (number + 1) % count])
    disc = {"mesh": (corners, faces), "material": SHINY, "sides": "both"}
    scene = view("cube").model_dump(exclude_none=True) | {"objects": [disc]}
    verdict = verify(Scene.model_validate(scene), renderer=renderer, shading=rate)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.used < 0.8


def test_an_edge_on_disc_may_show_any_of_its_triangles(renderer: Renderer) -> None:
    """The base of the cone is seen exactly edge-on, so its depth at a pixel has no meaning."""
    scene = Scene.model_validate(
        {
            "film": {"size": (96, 64)},
            "camera": {"type": "orthographic", "eye": (0, 0, 1), "up": (0, 0, 1), "fit": True},
            "objects": [
                {
                    "shape": {"type": "cone", "segments": 64},
                    "transform": {"rotate": (0, 5, 1), "scale": (3, 1, 2)},
                    "material": {"brdf": "principled", "kd": 0.0, "specular": 0.0},
                    "shading": "flat",
                }
            ],
            "lights": [{"type": "point", "position": (0, -2, 0), "colour": (0, 0, 1), "falloff": "none"}],
        }
    )
    assert verify(scene, renderer=renderer).verdict == "verified"


# Dense meshes.


@pytest.mark.parametrize("sides", ["auto", "both"])
def test_triangles_smaller_than_a_pixel_are_verified(sides: str, renderer: Renderer) -> None:
    verdict = verify(view({"type": "sphere", "segments": 1024, "rings": 512}, (160, 120), sides=sides), renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.ambiguous < 0.01


def test_a_hole_in_a_dense_mesh_is_found(renderer: Renderer) -> None:
    """Wherever the reference says that no gap can be, the background is not accepted."""
    scene = view({"type": "sphere", "segments": 512, "rings": 256}, (80, 60))
    picture = renderer.render(scene, dtype="float32").pixels.copy()
    picture[30, 40] = 0
    verdict = verify(scene, picture=picture, renderer=renderer)
    assert (verdict.verdict, verdict.unexplained) == ("failed", 1)


# Large surfaces.


@pytest.mark.parametrize("scale", [1e2, 1e4])
def test_a_large_floor_is_verified(scale: float, renderer: Renderer) -> None:
    floor = view("plane", transform={"translate": (0, -1, 0), "scale": (scale, 1, scale)})
    verdict = verify(floor, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.comparison.tolerance < 2e-3


def test_a_floor_that_float32_cannot_hold_is_not_called_wrong(renderer: Renderer) -> None:
    floor = view("plane", transform={"translate": (0, -1, 0), "scale": (1e6, 1, 1e6)})
    assert verify(floor, renderer=renderer).verdict != "failed"


@pytest.mark.parametrize("size", [0.01, 0.3, 1.0])
@pytest.mark.parametrize("falloff", ["none", "1/r^2"])
def test_the_interval_holds_wherever_a_position_may_be(size: float, falloff: Any) -> None:
    """The light's foot lies inside the boxes of possible positions."""
    light = {"type": "point", "position": (0.2, 1.0, 0.1), "falloff": falloff, "intensity": 3}
    draw = prepare(view("plane", light=light, material={"brdf": "lambert", "kd": 0.8})).draws[0]
    random = np.random.default_rng(1)
    count = 100
    middle = random.uniform(-2, 2, (count, 3)) * (1, 0, 1)
    surface = replace(at_vertices(draw, np.zeros(count, dtype=np.intp), np.float64), position=middle - (1.2, 1.5, 3.5))
    error = np.full((count, 3), size) * (1, 1e-6, 1)
    value = evaluate_surface(draw, surface)
    low, high, _, _ = bounds.over_box(draw, evaluate_surface, surface, "position", error, value, material_of(draw, surface))
    for _ in range(200):
        moved = replace(surface, position=surface.position + random.uniform(-1, 1, (count, 3)) * error)
        light_there = evaluate_surface(draw, moved)
        slack = 0.05 * (high - low)
        assert (light_there <= np.maximum(high, value) + slack).all()
        assert (light_there >= np.minimum(low, value) - slack).all()


# Wide and dim pictures.


def test_a_pixel_that_accepts_anything_is_not_decided() -> None:
    expected = find_candidates(view({"type": "cylinder", "segments": 4096})).expected
    width = (expected.high - expected.low).max(axis=1)
    wide = expected.pixel[width > 0.2 * expected.centre.max()]
    assert len(wide)
    assert (expected.classes[wide] == PixelClass.WIDE).all()


@pytest.mark.parametrize("intensity", [1.0, 1e-20, 1e-30, 1e-35])
def test_black_is_wrong_however_dim_the_light_is(intensity: float, renderer: Renderer) -> None:
    scene = view("sphere", (48, 36), {**POINT, "intensity": intensity})
    assert verify(scene, renderer=renderer).verdict == "verified"
    assert verify(scene, picture=np.zeros((36, 48, 3), dtype=np.float32)).verdict == "failed"
