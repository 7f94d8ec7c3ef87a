"""Judges pictures of extreme scenes against the float64 reference, where most pixels may lie on the edge of a triangle.

`glshade.verify` gives up on a picture with too many pixels at edges, and the scenes of test_extremes_*.py show little else.
Here the reference lists, for each pixel, every fragment that a driver might draw there: within 3/256 pixel of an edge, coverage
may go either way. A fragment is certain if every driver must draw it. A pixel is right if it shows one of the listed fragments
that is not hidden by a certain one. The pixel may differ from the fragment's linear light c by the sum of three terms:

    2e-5 max(1, |c|)          for the arithmetic of the model and for normals that interpolation makes very short
    4 |float32 - float64|     for the digits that the reference loses when it runs in float32
    the change of c           when the attributes are taken 1/256 pixel to each side: the driver's plane equations are float32

A pixel is also right if it shows the background and no certain fragment covers it. A mixture of two fragments is wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade import Mesh, Renderer, Scene
from glshade.reference.inputs import prepare
from glshade.reference.raster import MARGIN, Fragments, rasterise
from glshade.reference.shade import Sampling, shade_fragments
from glshade.scene.object import Rate

Array = NDArray[np.float64]

# A fragment whose reversed depth is smaller by this share is certainly hidden. float32 depth has a relative error of 6e-8.
BEHIND = 1e-4
# How far the attributes are moved to each side [pixels].
STEP = 1 / 256
# The error of the model's own arithmetic, relative to max(1, |c|).
ARITHMETIC = 2e-5

SUN: dict[str, Any] = {"type": "directional", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)}
CAMERA: dict[str, Any] = {"eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "fov": 30}
BALL: dict[str, Any] = {"shape": {"type": "icosphere", "subdivisions": 3}}
# Phong does not use tangents, Ashikhmin-Shirley does.
MATERIALS: dict[str, dict[str, Any]] = {
    "phong": {"brdf": "phong", "kd": (0.7, 0.5, 0.3), "ks": 0.4, "exponent": 50.0},
    "ashikhmin_shirley": {"brdf": "ashikhmin_shirley", "kd": (0.4, 0.5, 0.3), "ks": 0.2, "pu": 20.0, "pv": 200.0},
}
RATES: tuple[Rate, ...] = ("phong", "gouraud", "flat")


@dataclass(frozen=True)
class Judged:
    """A picture in which every pixel was found right.

    pixels: the picture as drawn, linear light and alpha, (H, W, 4) float32.
    drawn: the number of pixels whose alpha is above 0.
    worst: the largest error relative to max(1, |c|) among pixels with one certain fragment; NaN if there are none.
    """

    pixels: NDArray[np.float32]
    drawn: int
    worst: float


def judge(scene: Scene, renderer: Renderer, shading: Rate | None = None, slack: float = 0.0) -> Judged:
    """Draws the scene on a transparent background and compares every pixel with the reference.

    slack: an addition to the tolerance, relative to max(1, |c|), for tests that know how badly their scene is conditioned.
    Errors: AssertionError if a value is not finite or a pixel is wrong.
    """
    film = scene.film.model_copy(update={"background": (0.0, 0.0, 0.0, 0.0)})
    scene = scene.model_copy(update={"film": film})
    picture = renderer.render(scene, dtype="float32", shading=shading).pixels.copy()
    assert np.isfinite(picture).all(), f"{(~np.isfinite(picture)).any(axis=2).sum()} pixels are not finite"
    height, width = picture.shape[:2]
    shown = picture.reshape(-1, 4).astype(np.float64)
    inputs = prepare(scene, shading)
    fragments, nearest = _visible(Fragments.joined(rasterise(inputs, MARGIN)), width * height)
    right = (shown == 0).all(axis=1) & (nearest == 0)
    if not len(fragments):
        assert right.all(), f"{(~right).sum()} pixels are drawn where the reference has no fragment"
        return Judged(picture, 0, float("nan"))
    value, tolerance = _value_and_tolerance(inputs, fragments, slack)
    error = np.abs(shown[fragments.pixel] - value)
    right[fragments.pixel[(error <= tolerance).all(axis=1)]] = True
    if not right.all():
        pixel = int(np.flatnonzero(~right)[0])
        candidates = fragments.pixel == pixel
        raise AssertionError(
            f"{(~right).sum()} of {len(right)} pixels are wrong; x {pixel % width}, y {pixel // width} shows {shown[pixel]}, "
            f"allowed are {value[candidates]} +- {tolerance[candidates]}{' or nothing' if nearest[pixel] == 0 else ''}"
        )
    alone = np.bincount(fragments.pixel, minlength=len(right))[fragments.pixel] == 1
    sure = alone & fragments.covered & ~fragments.partial
    worst = (error / np.maximum(1, np.abs(value)))[sure].max() if sure.any() else float("nan")
    return Judged(picture, int((shown[:, 3] > 0).sum()), float(worst))


def _visible(fragments: Fragments, pixels: int) -> tuple[Fragments, Array]:
    """Returns the fragments that no certain fragment hides, and the reversed depth of the nearest certain fragment of each
    pixel (pixels,), which is 0 where a pixel has no certain fragment."""
    # Nothing is drawn at a depth of 0 or less.
    fragments = fragments.take(fragments.depth > 0)
    certain = fragments.covered & ~fragments.partial
    nearest = np.zeros(pixels)
    np.maximum.at(nearest, fragments.pixel[certain], fragments.depth[certain])
    return fragments.take(fragments.depth >= nearest[fragments.pixel] * (1 - BEHIND)), nearest


def _value_and_tolerance(inputs: Any, fragments: Fragments, slack: float) -> tuple[Array, Array]:
    """Returns (value, tolerance), each (N, 4): linear light and alpha of N fragments, and the error that is allowed."""
    value = shade_fragments(inputs, fragments)
    with np.errstate(all="ignore"):
        single = shade_fragments(inputs, fragments, Sampling(dtype=np.float32))
    tolerance = (ARITHMETIC + slack) * np.maximum(1, np.abs(value))
    tolerance += 4 * np.where(np.isfinite(single), np.abs(single - value), 0)
    sides = [shade_fragments(inputs, fragments, Sampling(offset=o)) for o in ((STEP, 0), (-STEP, 0), (0, STEP), (0, -STEP))]
    return value, tolerance + np.max([np.abs(side - value) for side in sides], axis=0)


def scene(objects: Any, lights: Any, size: tuple[int, int] = (48, 48), **more: Any) -> Scene:
    """Returns a scene of one object or several; `more` holds other keys of a scene file."""
    objects = [objects] if isinstance(objects, dict) else objects
    return Scene.model_validate({"objects": objects, "lights": lights, "film": {"size": size}, **more})


def triangles(corners: Any, material: Any) -> dict[str, Any]:
    """Returns an object made of triangles that share no corners, seen from both sides. corners: (3 T, 3)."""
    corners = np.asarray(corners, dtype=np.float64).reshape(-1, 3)
    mesh = Mesh.build(corners, np.arange(len(corners)).reshape(-1, 3))
    return {"mesh": mesh, "material": material, "sides": "both"}


def judge_all(make: Callable[[Any], Scene], renderer: Renderer, slack: float = 0.0) -> tuple[int, float]:
    """Judges make(material) with both materials at all rates. Returns (the fewest pixels drawn, the largest `worst`)."""
    found = [judge(make(material), renderer, rate, slack) for material in MATERIALS.values() for rate in RATES]
    return min(one.drawn for one in found), float(np.fmax.reduce([one.worst for one in found]))
