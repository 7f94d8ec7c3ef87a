"""Whether a picture is what the float64 reference says: for tests of extreme scenes, where most pixels may be rims.

At each pixel the reference lists every fragment that a driver might draw there (within 3/256 pixel of an edge, coverage may go
either way). The pixel is explained where one that nothing certain hides has its value, within

    2e-5 max(1, |c|)                                 the model's own arithmetic, and normals interpolated to nearly nothing
    4 x |float32 - float64|                          what the same reference loses when it runs in float32
    the change of c by 1/256 pixel                   where the driver's attributes stand: its plane equations are float32

or where nothing certainly covers it and it shows the background. There is no blending between candidates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade import Mesh, Renderer, Scene, reference
from glshade.reference import Fragments, Sampling
from glshade.scene.scene import Rate

Array = NDArray[np.float64]

# Of reversed depth, relative: farther behind than this is hidden for certain. float32 depth has 6e-8.
BEHIND = 1e-4
STEP = 1 / 256
ARITHMETIC = 2e-5


SUN: dict[str, Any] = {"type": "directional", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)}
CAMERA: dict[str, Any] = {"eye": (0.4, 0.9, 5.2), "target": (0.0, 0.0, 0.0), "fov": 30}
BALL: dict[str, Any] = {"shape": {"type": "icosphere", "subdivisions": 3}}
# One model that does not look at tangents, and one that does.
MATERIALS: dict[str, dict[str, Any]] = {
    "phong": {"brdf": "phong", "kd": (0.7, 0.5, 0.3), "ks": 0.4, "exponent": 50.0},
    "ashikhmin_shirley": {"brdf": "ashikhmin_shirley", "kd": (0.4, 0.5, 0.3), "ks": 0.2, "pu": 20.0, "pv": 200.0},
}
RATES: tuple[Rate, ...] = ("phong", "gouraud", "flat")


@dataclass(frozen=True)
class Explained:
    """pixels (H, W, 4): as drawn. drawn: how many pixels show something. worst: the largest error relative to max(1, |c|) at
    pixels with one certain candidate, NaN without any; of_bound: the largest error in units of its own bound there."""

    pixels: NDArray[np.float32]
    drawn: int
    worst: float
    of_bound: float


def explain(scene: Scene, renderer: Renderer, shading: Rate | None = None, slack: float = 0.0) -> Explained:
    """Draws the scene, on a background with alpha, and compares. AssertionError for what is not finite or not explained.

    slack: added to the bound, relative to max(1, |c|), where the scene's own conditioning is known.
    """
    film = scene.film.model_copy(update={"background": (0.0, 0.0, 0.0, 0.0)})
    scene = scene.model_copy(update={"film": film})
    gpu = renderer.render(scene, dtype="float32", shading=shading).pixels.copy()
    height, width = gpu.shape[:2]
    assert np.isfinite(gpu).all(), f"{(~np.isfinite(gpu)).any(axis=2).sum()} pixels are not finite"
    inputs = reference.prepare(scene, shading)
    found = Fragments.joined(reference.rasterise(inputs, reference.MARGIN))
    # A depth of 0 or less is where nothing is drawn.
    found = found.take(found.depth > 0)
    flat = gpu.reshape(-1, 4).astype(np.float64)
    ok = (flat == 0).all(axis=1)
    certain = found.covered & ~found.partial
    nearest = np.zeros(width * height)
    np.maximum.at(nearest, found.pixel[certain], found.depth[certain])
    ok &= nearest == 0
    if not len(found):
        assert ok.all(), f"{(~ok).sum()} pixels are drawn where nothing is"
        return Explained(gpu, 0, float("nan"), float("nan"))
    found = found.take(found.depth >= nearest[found.pixel] * (1 - BEHIND))
    value = reference.shade(inputs, found)
    with np.errstate(all="ignore"):
        single = reference.shade(inputs, found, Sampling(dtype=np.float32))
    bound = (ARITHMETIC + slack) * np.maximum(1, np.abs(value))
    bound += 4 * np.where(np.isfinite(single), np.abs(single - value), 0)
    sides = [reference.shade(inputs, found, Sampling(offset=o)) for o in ((STEP, 0), (-STEP, 0), (0, STEP), (0, -STEP))]
    bound += np.max([np.abs(side - value) for side in sides], axis=0)
    error = np.abs(flat[found.pixel] - value)
    hit = (error <= bound).all(axis=1)
    ok[found.pixel[hit]] = True
    if not ok.all():
        pixel = int(np.flatnonzero(~ok)[0])
        here = found.pixel == pixel
        raise AssertionError(
            f"{(~ok).sum()} of {len(ok)} pixels are not explained; x {pixel % width}, y {pixel // width} is {flat[pixel]}, "
            f"and may be {value[here]} +- {bound[here]}{' or nothing' if nearest[pixel] == 0 else ''}"
        )
    counts = np.bincount(found.pixel, minlength=len(ok))
    sure = (counts[found.pixel] == 1) & found.covered & ~found.partial
    worst = (error / np.maximum(1, np.abs(value)))[sure].max() if sure.any() else float("nan")
    share = (error / bound)[sure].max() if sure.any() else float("nan")
    return Explained(gpu, int((flat[:, 3] > 0).sum()), float(worst), float(share))


def scene(objects: Any, lights: Any, size: tuple[int, int] = (48, 48), **more: Any) -> Scene:
    """A scene in a few words."""
    objects = [objects] if isinstance(objects, dict) else objects
    return Scene.model_validate({"objects": objects, "lights": lights, "film": {"size": size}, **more})


def triangles(corners: Any, material: Any) -> dict[str, Any]:
    """An object of triangles with corners (3 T, 3) of their own, seen from both sides."""
    corners = np.asarray(corners, dtype=np.float64).reshape(-1, 3)
    mesh = Mesh.build(corners, np.arange(len(corners)).reshape(-1, 3))
    return {"mesh": mesh, "material": material, "sides": "both"}


def everywhere(make: Any, renderer: Renderer, slack: float = 0.0, rates: tuple[Rate, ...] = RATES) -> tuple[int, float]:
    """(pixels drawn at least, worst): make(material) as a scene of both materials, at all rates, explained."""
    found = [explain(make(material), renderer, rate, slack) for material in MATERIALS.values() for rate in rates]
    return min(one.drawn for one in found), float(np.fmax.reduce([one.worst for one in found]))
