"""The viewer is mirrored at a plane 1e-3 above the horizon of n; both renderers are checked against arithmetic by hand.

With n.v = z below 1e-3, the mirrored vector is v' = v + t n with t = 2e-3 - 2 z, so n.v' before normalisation is 2e-3 - z. As
|v + t n|^2 = 1 + 2 t z + t^2 = 1 + 2e-3 t, the mirrored cosine is (2e-3 - z) / sqrt(1 + 2e-3 t). A Phong lobe of exponent 1
with the light along n reflects along n, so its f cos is n.v' / pi, and a light of intensity 1 shows exactly n.v'.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from support.glsl import called

from glshade import Mesh, Renderer, Scene, reference

# n.v -> n.v', with the square root worked out: 1 + 2e-3 t is 1.00012, 1.000044, 1.000004 and 1.0000024.
BELOW = {
    -0.029: 0.031 / 1.0000599982,
    -0.01: 0.012 / 1.0000219998,
    0.0: 0.002 / 1.000002,
    0.0004: 0.0016 / 1.0000012,
}
# Higher viewers stay as they are, the plane itself included.
ABOVE = {0.001: 0.001, 0.5: 0.5}
COSINES = {**BELOW, **ABOVE}


def scene(cosine: float, rate: str) -> Scene:
    """Returns a triangle that faces the camera, whose vertex normals have the given cosine with the direction to the viewer,
    +z.
    """
    normal = (math.sqrt(1 - cosine * cosine), 0.0, cosine)
    corners = np.array([(-9.0, -9.0, 0.0), (9.0, -9.0, 0.0), (0.0, 9.0, 0.0)])
    mesh = Mesh.build(corners, [(0, 1, 2)], np.array([normal] * 3))
    lamp = {"type": "directional", "direction": [-c for c in normal]}
    material = {"brdf": "phong", "kd": 0.0, "ks": 1.0, "exponent": 1.0}
    return Scene.model_validate(
        {
            "objects": [{"mesh": mesh, "material": material, "shading": rate, "sides": "front"}],
            "lights": [lamp],
            "camera": {"type": "orthographic", "eye": (0, 0, 5), "target": (0, 0, 0), "height": 1},
            "film": {"size": (2, 2)},
        }
    )


@pytest.mark.parametrize("rate", ["gouraud", "phong"])
@pytest.mark.parametrize("cosine", COSINES)
def test_both_renderers_mirror_the_viewer(cosine: float, rate: str, renderer: Renderer) -> None:
    view = scene(cosine, rate)
    expected = np.full((2, 2, 3), COSINES[cosine])
    # A float32 normal has steps of 6e-8, which is what a small cosine is off by.
    assert reference.render(view).pixels[..., :3] == pytest.approx(expected, abs=2e-7)
    assert renderer.render(view, dtype="float32").pixels[..., :3] == pytest.approx(expected, abs=5e-7)


def test_the_shader_function_by_itself(renderer: Renderer) -> None:
    """above_horizon(v, n) with n = +z: the third component is n.v', and the result is a unit vector in the plane of v and n."""
    text = '#include "surface/horizon.glsl"\nvec3 value(vec3 n, vec3 v) {\n    return above_horizon(v, n);\n}\n'
    z = np.array(list(COSINES))
    v = np.stack([np.sqrt(1 - z * z), np.zeros_like(z), z], axis=1)
    mirrored = called(text, renderer, np.array([0.0, 0.0, 1.0]), v)
    assert mirrored[:, 2] == pytest.approx(np.array(list(COSINES.values())), abs=2e-9)
    assert np.linalg.norm(mirrored, axis=1) == pytest.approx(1, abs=2e-7)
    assert np.all(mirrored[:, 1] == 0)
