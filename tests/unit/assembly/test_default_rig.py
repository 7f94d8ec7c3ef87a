"""The default rig: the lights that a scene without lights is given, checked against directions worked out by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from glshade import Orthographic, Renderer, Scene, reference
from glshade.assembly.default_rig import rig

POINTS = np.zeros((1, 3))
# The directions to the key light and to the fill light, in the view's axes: right, up, and back toward the viewer.
KEY, FILL = (-0.7, 0.9, 0.8), (1.0, 0.1, 0.6)
# eye -> the directions in which key and fill shine, which point away from the lights.
# From (0, 0, 5), right is +x, up is +y and back is +z. From (5, 0, 0), right is -z, up is +y and back is +x.
EXPECTED = {
    (0.0, 0.0, 5.0): ((0.7, -0.9, -0.8), (-1.0, -0.1, -0.6)),
    (5.0, 0.0, 0.0): ((-0.8, -0.9, -0.7), (-0.6, -0.1, 1.0)),
}


def unit(direction: Any) -> Any:
    return np.asarray(direction) / np.linalg.norm(direction)


@pytest.mark.parametrize("eye", EXPECTED)
def test_directions_follow_the_camera(eye: tuple[float, float, float]) -> None:
    key, fill, _ = rig(Orthographic(eye=eye, target=(0.0, 0.0, 0.0)).view(POINTS, 1.0))
    for light, expected in zip((key, fill), EXPECTED[eye], strict=True):
        assert unit(light.direction) == pytest.approx(unit(expected), abs=1e-12)  # type: ignore[attr-defined]


def test_names_kinds_colours_and_intensities() -> None:
    lights = rig(Orthographic(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0)).view(POINTS, 1.0))
    assert [(light.name, light.type, light.intensity) for light in lights] == [  # type: ignore[attr-defined]
        ("key", "directional", 0.95),
        ("fill", "directional", 0.2),
        ("ambient", "ambient", 0.08),
    ]
    assert {light.colour for light in lights} == {(1.0, 1.0, 1.0)}


def test_what_a_wall_reflects(renderer: Renderer) -> None:
    """A white Lambertian wall that faces the viewer shows the sum of I n.l, with n along the third axis, and the ambient I."""
    camera = {"type": "orthographic", "eye": (0, 0, 5), "target": (0, 0, 0), "height": 1}
    wall = {"shape": "plane", "transform": {"rotate": (90, 0, 0), "scale": 4}, "material": {"brdf": "lambert", "kd": 1.0}}
    scene = Scene.model_validate({"objects": [wall], "camera": camera, "film": {"size": (4, 4)}})
    expected = 0.95 * KEY[2] / math.hypot(*KEY) + 0.2 * FILL[2] / math.hypot(*FILL) + 0.08
    assert expected == pytest.approx(0.95 * 0.57437 + 0.2 * 0.51262 + 0.08, abs=1e-5)
    for pixels in (reference.render(scene).pixels, renderer.render(scene, dtype="float32").pixels):
        assert pixels[..., :3] == pytest.approx(np.full((4, 4, 3), expected), rel=1e-6)
