"""Law: a light at the surface, at the viewer, next to nothing away, of the narrowest cone or of any strength is finite, and is
what the reference has."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from explained import BALL, CAMERA, MATERIALS, RATES, SUN, everywhere, explain, scene, triangles

from glshade import LIGHTS, Renderer

# Interior pixels, relative to max(1, |c|). Measured: 5.4e-6.
WORST = 5e-5
FALLOFFS = ("none", "1/r", "1/r^2")
ABOVE: dict[str, Any] = {"eye": (0.0, 0.0, 3.0), "target": (0.0, 0.0, 0.0)}
CORNERS = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def point(*position: float, **more: Any) -> dict[str, Any]:
    return {"type": "point", "position": position, **more}


@pytest.mark.parametrize("falloff", FALLOFFS)
@pytest.mark.parametrize("height", [0.0, 1e-30, 1e-20, 1e-10, 1e-4])
def test_at_the_surface(height: float, falloff: Any, renderer: Renderer) -> None:
    """Over a pixel's centre, a corner, and the middle of a triangle, where each rate has its point."""
    for x, y in ((0.25, -0.25), (1.0, 1.0), (1 / 3, -1 / 3)):
        drawn, _ = everywhere(
            lambda m, x=x, y=y: scene(triangles(CORNERS, m), [point(x, y, height, falloff=falloff)], camera=ABOVE), renderer
        )
        assert drawn > 500


@pytest.mark.parametrize("falloff", FALLOFFS)
def test_at_the_viewer(falloff: Any, renderer: Renderer) -> None:
    drawn, worst = everywhere(
        lambda m: scene({**BALL, "material": m}, [point(*CAMERA["eye"], falloff=falloff)], camera=CAMERA), renderer
    )
    assert drawn > 500
    assert worst <= WORST


@pytest.mark.parametrize("intensity", [1e-30, 1.0, -1e4, 1e30])
@pytest.mark.parametrize("falloff", ["1/r", "1/r^2"])
@pytest.mark.parametrize("r_min", [1e-300, 1e-30, 1e-20, 1e-15, 1e15, 1e30])
def test_any_least_distance(r_min: float, falloff: Any, intensity: float, renderer: Renderer) -> None:
    """At a corner, exactly, where no distance is left, and beside it. Infinitely strong times no direction would be NaN."""
    for place in ((1.0, 1.0, 0.0), (1.0, 1.0, 1e-15), (1.0, 1.0, 1.0)):
        lamp = point(*place, falloff=falloff, r_min=r_min, intensity=intensity)
        for material in MATERIALS.values():
            for rate in RATES:
                picture = scene(triangles(CORNERS, material), [lamp], (8, 8), camera=ABOVE)
                pixels = renderer.render(picture, dtype="float32", shading=rate).pixels
                assert np.isfinite(pixels).all(), rate


NARROW = math.degrees(1e-4)


@pytest.mark.parametrize(
    ("inner", "outer"),
    [(0, NARROW), (NARROW / 2, NARROW), (NARROW, NARROW), (30, 30), (90, 90), (180, 180), (0, 180)],
    ids=lambda angle: f"{angle:.3g}",
)
def test_cones(inner: float, outer: float, renderer: Renderer) -> None:
    """From the eye, so that the cone's edge is a circle in the picture."""
    lamp = {"type": "spot", "position": CAMERA["eye"], "direction": tuple(-c for c in CAMERA["eye"]), "falloff": "none"}
    lamp |= {"inner": inner, "outer": outer}
    camera = {**CAMERA, "fov": min(2.2 * outer, 30)}
    # The axis and l are unit float32 vectors, 2^-24 off either way; across a cone's edge light falls at 3/2 of its width, and
    # a cone of no edge is all slope.
    width = max(math.radians(outer) - math.radians(inner), 1e-6)
    slack = min(4 * 1.5 * 2**-24 / width, 1.0)
    drawn, _ = everywhere(lambda m: scene({**BALL, "material": m}, [lamp], camera=camera), renderer, slack)
    assert drawn > 500


def test_a_narrow_cone_is_where_it_should_be(renderer: Renderer) -> None:
    """1e-4 rad, half the picture: a cone compared by cosines would be all light or none."""
    lamp = {"type": "spot", "position": CAMERA["eye"], "direction": tuple(-c for c in CAMERA["eye"]), "falloff": "none"}
    lamp |= {"inner": NARROW * 0.95, "outer": NARROW}
    camera = {**CAMERA, "fov": 4 * NARROW}
    lit = renderer.render(scene(BALL, [lamp], camera=camera), dtype="float32").pixels[..., 0] > 0
    assert lit.mean() == pytest.approx(math.pi / 16, abs=0.02)


@pytest.mark.parametrize("intensity", [1e-45, 1e-38, 1e-30, 1e30, 1e37, -1e4])
@pytest.mark.parametrize("name", LIGHTS)
def test_any_strength(name: str, intensity: float, renderer: Renderer) -> None:
    place = {"position": (1.0, 2.0, 3.0), "falloff": "1/r"} if "position" in LIGHTS[name].model_fields else {}
    aim = {"direction": (-1.0, -2.0, -3.0)} if "direction" in LIGHTS[name].model_fields else {}
    lamp = {"type": name, **place, **aim}
    for material in MATERIALS.values():
        for rate in RATES:
            one, many = (
                explain(scene({**BALL, "material": material}, [{**lamp, "intensity": x}], camera=CAMERA), renderer, rate)
                for x in (1.0, intensity)
            )
            assert many.drawn == one.drawn > 500
            # Light is linear. Measured: 3.2e-6 of the peak, from the plane equations of gouraud; else 1.2e-7. Below the
            # smallest normal float stages may flush it to 0.
            peak = one.pixels[..., :3].max()
            change = many.pixels[..., :3].astype(np.float64) / np.float64(np.float32(intensity)) - one.pixels[..., :3]
            assert peak > 0.01
            assert np.abs(change).max() <= 1e-5 * peak or abs(intensity) <= 1e-37


@pytest.mark.parametrize("count", [1, 8, 9])
def test_positive_and_negative_lights_cancel(count: int, renderer: Renderer) -> None:
    """To the rounding of their sum: each of 2 count terms is at most 1 / count."""
    random = np.random.default_rng(count)
    for kind in ("directional", "point"):
        lamps = []
        for place in random.normal(size=(count, 3)):
            at = {"direction": tuple(-place)} if kind == "directional" else {"position": tuple(3 * place), "falloff": "1/r"}
            lamps.append({"type": kind, "intensity": 1 / count, **at})
        dark = [{**lamp, "intensity": -lamp["intensity"]} for lamp in lamps]
        for material in MATERIALS.values():
            for rate in RATES:
                lit = explain(scene({**BALL, "material": material}, lamps, camera=CAMERA), renderer, rate)
                none = explain(scene({**BALL, "material": material}, lamps + dark, camera=CAMERA), renderer, rate)
                highest = np.abs(lit.pixels[..., :3]).max()
                assert highest > 0.01
                # Measured: 2e-7 of the peak.
                assert np.abs(none.pixels[..., :3]).max() <= 2e-6 * max(1.0, highest)


def test_a_cancelling_pair_is_exactly_dark(renderer: Renderer) -> None:
    pixels = renderer.render(scene(BALL, [SUN, {**SUN, "intensity": -1.0}], camera=CAMERA), dtype="float32").pixels
    assert np.all(pixels == 0)
