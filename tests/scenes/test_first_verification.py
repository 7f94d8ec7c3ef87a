"""The first verification: every model at every rate under every light through both cameras, GPU against reference.

Rule: in linear light no channel of any pixel differs by more than WORST, but for the rim. The rim are the covered pixels that
have, among their eight neighbours, one whose depth differs by more than JUMP of the depth range, or that is not covered:
silhouettes and the edges of what hides something else. There the surface is seen edge on, and 1e-7 of a pixel is much of a
triangle. The rim's share of the picture is held under RIM, and outside it the same pixels must be covered.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from glshade import BRDFS, Mesh, Renderer, Scene, reference
from glshade.mesh import with_normals
from glshade.primitives import icosphere
from glshade.scene import Rate

# Measured on llvmpipe (Mesa 22.3.6): 6e-6. What is left are its float32 plane equations.
WORST = 5e-5
JUMP = 0.1
RIM = 0.05
SIZE = (160, 88)

LIGHTS: dict[str, dict[str, Any]] = {
    "directional": {"type": "directional", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)},
    "point": {"type": "point", "position": (1.5, 2.0, 3.0), "falloff": "none"},
    "point 1/r": {"type": "point", "position": (1.5, 2.0, 3.0), "falloff": "1/r", "intensity": 3.0},
    "point 1/r^2": {"type": "point", "position": (1.5, 2.0, 3.0), "falloff": "1/r^2", "intensity": 10.0},
    "spot": {
        **{"type": "spot", "position": (0.5, 2.0, 3.0), "direction": (-0.1, -0.6, -0.9), "falloff": "1/r^2"},
        **{"inner": 15.0, "outer": 35.0, "intensity": 10.0},
    },
    "ambient": {"type": "ambient", "colour": (0.2, 0.3, 0.4)},
}
CAMERAS: dict[str, dict[str, Any]] = {
    "perspective": {"type": "perspective", "eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "fov": 30},
    "orthographic": {"type": "orthographic", "eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "height": 2.6},
}


def bumpy() -> Mesh:
    """A sphere with hills and valleys that hide each other, and smooth normals."""
    mesh = icosphere(3)
    p = mesh.positions.astype(np.float64)
    p *= 1 + 0.18 * np.sin(5 * p[:, :1]) * np.sin(4 * p[:, 1:2] + 1) * np.sin(6 * p[:, 2:] + 2)
    return with_normals(Mesh.build(p, mesh.triangles), "smooth", 180.0)


def material(brdf: str) -> dict[str, Any]:
    """The model with colours that are not grey and scalars that are not equal, so that none can stand for another."""
    model, shares = BRDFS[brdf], iter((1.0, 0.25, 0.5, 0.75, 0.4, 0.6, 0.3, 0.7))
    values: dict[str, Any] = {"brdf": brdf}
    for name, field in model.parameters().items():
        default = model.model_fields[name].default
        if model.is_colour(name) and default is not None:
            values[name] = tuple(c * share for c, share in zip(default, (1.0, 0.8, 0.6), strict=True))
        elif default is not None:
            values[name] = max(default * next(shares), field.low)
    return values


def picture(brdf: str, light: str, camera: str, bumpy: Mesh) -> Scene:
    shapes: list[dict[str, Any]] = [
        {"shape": {"type": "sphere", "segments": 48, "rings": 24}, "transform": {"translate": (-1.1, 0.0, 0.0)}},
        {"mesh": bumpy, "transform": {"translate": (1.1, 0.0, 0.0)}},
    ]
    return Scene.model_validate(
        {
            "film": {"size": SIZE, "background": (0.0, 0.0, 0.0, 0.0)},
            "camera": CAMERAS[camera],
            "objects": [{**shape, "material": material(brdf)} for shape in shapes],
            "lights": [LIGHTS[light]],
        }
    )


def rim(inputs: reference.Inputs) -> NDArray[np.bool_]:
    """(H, W): the pixels that the module's rule leaves out."""
    nearest, _ = reference.resolve(inputs, reference.rasterise(inputs), lambda some: np.ones(len(some), dtype=bool))
    width, height = inputs.size
    depth = np.zeros(width * height)
    depth[nearest.pixel] = nearest.depth
    depth = depth.reshape(height, width)
    around = np.pad(depth, 1, mode="edge")
    # What is not covered has depth 0; no covered pixel here has.
    result = np.zeros((height, width), dtype=bool)
    for dy in range(3):
        for dx in range(3):
            beside = around[dy : dy + height, dx : dx + width]
            result |= (np.abs(beside - depth) > JUMP) | (beside == 0)
    return result & (depth > 0)


@pytest.fixture(scope="module")
def bumps() -> Mesh:
    return bumpy()


@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize("brdf", list(BRDFS))
def test_gpu_agrees_with_reference(renderer: Renderer, bumps: Mesh, brdf: str, rate: Rate) -> None:
    problems, worst = [], 0.0
    for light in LIGHTS:
        for camera in CAMERAS:
            scene = picture(brdf, light, camera, bumps)
            gpu = renderer.render(scene, dtype="float32", shading=rate).pixels.astype(np.float64)
            expected = reference.radiance(scene, shading=rate)
            left_out = rim(reference.prepare(scene, rate))
            counted = ~left_out
            assert np.isfinite(gpu).all(), f"{light}, {camera}: not finite"
            assert (expected[..., 3] > 0).mean() > 0.2, "the shapes are in the picture"
            assert left_out.mean() < RIM, f"{light}, {camera}: the rim is {left_out.mean():.1%} of the picture"
            mismatches = int(((gpu[..., 3] > 0) != (expected[..., 3] > 0))[counted].sum())
            error = np.abs(gpu - expected).max(axis=2)[counted]
            worst = max(worst, float(error.max()))
            if mismatches or error.max() > WORST:
                problems.append(f"{light}, {camera}: {error.max():.2e}, {mismatches} pixels covered in one alone")
    print(f"{brdf} per {rate}: worst {worst:.1e}")
    assert not problems, "\n".join(problems)
