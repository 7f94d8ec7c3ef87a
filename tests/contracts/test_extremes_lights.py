"""Property: the picture is finite and what the reference allows under a light at the surface, at the viewer or extremely near,
with the narrowest cone, or of any strength."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from support.judge import BALL, CAMERA, MATERIALS, RATES, SUN, judge, judge_all, scene, triangles

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
    """The light is above a pixel's centre, a corner, and the middle of a triangle: the points at which the three shading rates
    evaluate the light."""
    for x, y in ((0.25, -0.25), (1.0, 1.0), (1 / 3, -1 / 3)):
        drawn, _ = judge_all(
            lambda m, x=x, y=y: scene(triangles(CORNERS, m), [point(x, y, height, falloff=falloff)], camera=ABOVE), renderer
        )
        assert drawn > 500


@pytest.mark.parametrize("falloff", FALLOFFS)
def test_at_the_viewer(falloff: Any, renderer: Renderer) -> None:
    drawn, worst = judge_all(
        lambda m: scene({**BALL, "material": m}, [point(*CAMERA["eye"], falloff=falloff)], camera=CAMERA), renderer
    )
    assert drawn > 500
    assert worst <= WORST


@pytest.mark.parametrize("intensity", [1e-30, 1.0, -1e4, 1e30])
@pytest.mark.parametrize("falloff", ["1/r", "1/r^2"])
@pytest.mark.parametrize("r_min", [1e-300, 1e-30, 1e-20, 1e-15, 1e15, 1e30])
def test_any_least_distance(r_min: float, falloff: Any, intensity: float, renderer: Renderer) -> None:
    """The light is at a corner, where the distance is 0, and beside the corner. Infinite light times 0 would be NaN."""
    for place in ((1.0, 1.0, 0.0), (1.0, 1.0, 1e-15), (1.0, 1.0, 1.0)):
        lamp = point(*place, falloff=falloff, r_min=r_min, intensity=intensity)
        for material in MATERIALS.values():
            for rate in RATES:
                picture = scene(triangles(CORNERS, material), [lamp], (8, 8), camera=ABOVE)
                pixels = renderer.render(picture, dtype="float32", shading=rate).pixels
                assert np.isfinite(pixels).all(), rate


NARROW = math.degrees(1e-4)
# The lights that shine into a cone.
CONES = [name for name, model in LIGHTS.items() if "outer" in model.model_fields]


@pytest.mark.parametrize("kind", CONES)
@pytest.mark.parametrize(
    ("inner", "outer"),
    [(0, NARROW), (NARROW / 2, NARROW), (NARROW, NARROW), (30, 30), (90, 90), (180, 180), (0, 180)],
    ids=lambda angle: f"{angle:.3g}",
)
def test_cones(inner: float, outer: float, kind: str, renderer: Renderer) -> None:
    """The light is at the eye, so that the cone's edge is a circle in the picture."""
    lamp = {"type": kind, "position": CAMERA["eye"], "direction": tuple(-c for c in CAMERA["eye"]), "falloff": "none"}
    lamp |= {"inner": inner, "outer": outer}
    camera = {**CAMERA, "fov": min(2.2 * outer, 30)}
    # The axis and l are unit float32 vectors with an error of up to 2^-24. Across a cone's edge the slope of the light is at
    # most 3/2 (spot) or 2 (gltf_spot), divided by the edge's width. An edge of width 0 is a step, which rounding may move.
    width = max(math.radians(outer) - math.radians(inner), 1e-6)
    slack = min(4 * 2 * 2**-24 / width, 1.0)
    drawn, _ = judge_all(lambda m: scene({**BALL, "material": m}, [lamp], camera=camera), renderer, slack)
    assert drawn > 500


def test_a_narrow_cone_is_where_it_should_be(renderer: Renderer) -> None:
    """The cone is 1e-4 rad, half the picture. Cosines of such angles round to 1, so a comparison of cosines would light
    everything or nothing."""
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
                judge(scene({**BALL, "material": material}, [{**lamp, "intensity": x}], camera=CAMERA), renderer, rate)
                for x in (1.0, intensity)
            )
            assert many.drawn == one.drawn > 500
            # The picture is linear in the intensity. Measured: 3.2e-6 of the peak at rate gouraud, because of its plane
            # equations; otherwise 1.2e-7. Stages may flush values below the smallest normal float to 0.
            peak = one.pixels[..., :3].max()
            change = many.pixels[..., :3].astype(np.float64) / np.float64(np.float32(intensity)) - one.pixels[..., :3]
            assert peak > 0.01
            assert np.abs(change).max() <= 1e-5 * peak or abs(intensity) <= 1e-37


@pytest.mark.parametrize("count", [pytest.param(8, marks=pytest.mark.slow), 9])
def test_positive_and_negative_lights_cancel(count: int, renderer: Renderer) -> None:
    """The lights cancel up to the rounding of their sum, which has 2 count terms of at most 1 / count."""
    random = np.random.default_rng(count)
    for kind, model in LIGHTS.items():
        lamps: list[dict[str, Any]] = []
        for place in random.normal(size=(count, 3)):
            aim = {"direction": tuple(-place)} if "direction" in model.model_fields else {}
            at = {"position": tuple(3 * place), "falloff": "1/r"} if "position" in model.model_fields else {}
            lamps.append({"type": kind, "intensity": 1 / count, **aim, **at})
        dark = [{**lamp, "intensity": -lamp["intensity"]} for lamp in lamps]
        for material in MATERIALS.values():
            for rate in RATES:
                lit = judge(scene({**BALL, "material": material}, lamps, camera=CAMERA), renderer, rate)
                none = judge(scene({**BALL, "material": material}, lamps + dark, camera=CAMERA), renderer, rate)
                highest = np.abs(lit.pixels[..., :3]).max()
                assert highest > 0.01
                # Measured: 2e-7 of the peak.
                assert np.abs(none.pixels[..., :3]).max() <= 2e-6 * max(1.0, highest)


@pytest.mark.parametrize("rate", RATES)
def test_a_cancelling_pair_is_exactly_dark(rate: Any, renderer: Renderer) -> None:
    for material in MATERIALS.values():
        view = scene({**BALL, "material": material}, [SUN, {**SUN, "intensity": -1.0}], camera=CAMERA)
        assert np.all(renderer.render(view, dtype="float32", shading=rate).pixels == 0)
