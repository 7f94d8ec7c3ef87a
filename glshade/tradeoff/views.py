"""Views: a scene seen from other places, on which a choice is tried before it is trusted."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import assemble
from glshade.scene.camera import Orthographic, Perspective
from glshade.scene.scene import Scene

Array = NDArray[np.float64]
# Pictures to measure errors by are made this large at most [pixels].
LARGEST = 384
# The golden angle: turned by it again and again, places never meet.
GOLDEN = math.pi * (3 - math.sqrt(5))


def views(scene: Scene, count: int, start: float = 0.0, largest: int = LARGEST) -> list[Scene]:
    """The scene's own view, then others about what it looks at, as far away, `count` in all; pictures at most `largest` wide.

    Every other one is as high as the scene's own (a turntable), the rest are spread over the whole sphere, both by the golden
    angle. start [rad]: turns all but the first, so that other numbers give other views. Errors: SceneError.
    """
    width, height = scene.film.size
    share = min(1.0, largest / max(width, height))
    size = (max(round(width * share), 1), max(round(height * share), 1))
    # Whole pictures, one sample a pixel: a choice has to do wherever one looks.
    film = scene.film.model_copy(update={"size": size, "samples": 1, "supersample": 1, "crop": None})
    scene = scene.model_copy(update={"film": film})
    assembly = assemble(scene)
    view, camera = assembly.view, scene.camera
    corners = np.concatenate([_corners(i.mesh.bounds - i.mesh.origin, i.world_from_object) for i in assembly.instances])
    low, high = corners.min(axis=0), corners.max(axis=0)
    backward = view.axes[2]
    # What the scene looks at: its target, else the point on its axis that is nearest to the middle of everything.
    along = float((view.eye - (low + high) / 2) @ backward)
    target = np.array(camera.target) if camera.target is not None else view.eye - along * backward
    distance = float(np.linalg.norm(view.eye - target))
    up = np.array(camera.up, dtype=np.float64) / np.linalg.norm(camera.up)
    height_of = float(backward @ up)
    found = [scene]
    for k in range(1, count):
        angle = start + k * GOLDEN
        z = height_of if k % 2 else 1 - 2 * ((k // 2 + start / math.pi) % (count / 2)) / (count / 2)
        direction = _around(backward, up, angle, z)
        half = {"fov": camera.fov} if isinstance(camera, Perspective) else {"height": 2 * view.half_height}
        kind = Perspective if view.perspective else Orthographic
        moved = kind.model_validate({"eye": target + distance * direction, "target": target, "up": tuple(up), **half})
        found.append(scene.model_copy(update={"camera": moved}))
    return found


def _around(backward: Array, up: Array, angle: float, z: float) -> Array:
    """(3,) unit: turned about `up` by the angle, at the height z."""
    z = min(max(z, -0.999), 0.999)
    flat = backward - up * (backward @ up)
    if np.linalg.norm(flat) < 1e-6:
        flat = np.eye(3)[int(np.argmin(np.abs(up)))]
        flat = flat - up * (flat @ up)
    flat = flat / np.linalg.norm(flat)
    side = np.cross(up, flat)
    level = math.cos(angle) * flat + math.sin(angle) * side
    result: Array = math.sqrt(1 - z * z) * level + z * up
    return result


def _corners(bounds: Array, world: Array) -> Array:
    which = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    result: Array = bounds[which, np.arange(3)] @ world[:3, :3].T + world[:3, 3]
    return result
