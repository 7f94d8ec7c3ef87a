"""Property: every model and every preset is verified pixel by pixel, at every rate, under every light, through both cameras."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from glshade import BRDFS, LIGHTS, Mesh, Renderer, Scene, verify
from glshade.mesh.normals import with_normals
from glshade.mesh.primitives import icosphere
from glshade.presets import PRESETS, preset
from glshade.scene.object import Rate
from glshade.verification.judgement import PixelClass
from glshade.verification.survey import lights

SIZE = (160, 88)
RATES: tuple[Rate, ...] = ("flat", "gouraud", "phong")

LAMPS = lights()
# One light of each type that has a direction. The last of a type's falloffs, 1/r^2, stands for the others.
DIRECTED = {light["type"]: light for light in LAMPS.values() if not LIGHTS[light["type"]].omnidirectional}
CAMERAS: dict[str, dict[str, Any]] = {
    "perspective": {"type": "perspective", "eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "fov": 30},
    "orthographic": {"type": "orthographic", "eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "height": 2.6},
}


def bumpy() -> Mesh:
    """Returns a sphere with hills and valleys that hide each other, and smooth normals."""
    mesh = icosphere(3)
    p = mesh.positions.astype(np.float64)
    p *= 1 + 0.18 * np.sin(5 * p[:, :1]) * np.sin(4 * p[:, 1:2] + 1) * np.sin(6 * p[:, 2:] + 2)
    return with_normals(Mesh.build(p, mesh.triangles), "smooth", 180.0)


def material(brdf: str) -> dict[str, Any]:
    """Returns the model with colours that are not grey and scalars that are not equal, so that none can stand for another."""
    model, shares = BRDFS[brdf], itertools.cycle((1.0, 0.25, 0.5, 0.75, 0.4, 0.6, 0.3, 0.7))
    values: dict[str, Any] = {"brdf": brdf}
    for name, field in model.parameters().items():
        default = model.model_fields[name].default
        if model.is_colour(name) and default is not None:
            values[name] = tuple(c * share for c, share in zip(default, (1.0, 0.8, 0.6), strict=True))
        elif default is not None:
            values[name] = max(default * next(shares), field.low)
    return values


def picture(material: dict[str, Any], lights: list[dict[str, Any]], camera: dict[str, Any], bumpy: Mesh) -> Scene:
    shapes: list[dict[str, Any]] = [
        {"shape": {"type": "sphere", "segments": 48, "rings": 24}, "transform": {"translate": (-1.1, 0.0, 0.0)}},
        {"mesh": bumpy, "transform": {"translate": (1.1, 0.0, 0.0)}},
    ]
    return Scene.model_validate(
        {
            "film": {"size": SIZE, "background": (0.0, 0.0, 0.0, 0.0)},
            "camera": camera,
            "objects": [{**shape, "material": material} for shape in shapes],
            "lights": lights,
        }
    )


@pytest.fixture(scope="module")
def bumps() -> Mesh:
    return bumpy()


def check(scene: Scene, renderer: Renderer, rate: Rate, place: str) -> None:
    """Every pixel is explained, and shapes cover a fifth of the picture. They are small, so many pixels lie on outlines."""
    verdict = verify(scene, renderer=renderer, shading=rate, max_ambiguous=0.08)
    drawn = 1 - verdict.comparison.counts[PixelClass.BACKGROUND] / (SIZE[0] * SIZE[1])
    assert drawn > 0.2, place
    assert verdict.verdict == "verified", f"{place}: {verdict}"


@pytest.mark.parametrize("rate", [pytest.param("flat", marks=pytest.mark.slow), "gouraud", "phong"])
@pytest.mark.parametrize("brdf", list(BRDFS))
def test_models(renderer: Renderer, bumps: Mesh, brdf: str, rate: Rate) -> None:
    """One light of each type shines at once. The slow test takes them one by one."""
    check(picture(material(brdf), list(DIRECTED.values()), CAMERAS["perspective"], bumps), renderer, rate, brdf)


@pytest.mark.slow
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("brdf", list(BRDFS))
def test_models_under_every_light_through_both_cameras(renderer: Renderer, bumps: Mesh, brdf: str, rate: Rate) -> None:
    for (light, lamp), (camera, seen) in itertools.product(LAMPS.items(), CAMERAS.items()):
        check(picture(material(brdf), [lamp], seen, bumps), renderer, rate, f"{light}, {camera}")


@pytest.mark.slow
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("name", list(PRESETS))
def test_presets(renderer: Renderer, bumps: Mesh, name: str, rate: Rate) -> None:
    for light, lamp in DIRECTED.items():
        check(picture(preset(name), [lamp], CAMERAS["perspective"], bumps), renderer, rate, light)
