"""Views: a scene from many viewpoints, to check a choice of settings from all sides."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import assemble
from glshade.scene.camera import Orthographic, Perspective
from glshade.scene.scene import Scene

Array = NDArray[np.float64]
# The longest side of the pictures on which errors are measured [pixels].
LARGEST = 384
# The golden angle [rad]. Directions that are turned by it again and again never coincide, and are spread evenly.
GOLDEN = math.pi * (3 - math.sqrt(5))


def views_around(scene: Scene, count: int, start: float = 0.0, largest: int = LARGEST) -> list[Scene]:
    """Returns the scene from `count` viewpoints: first its own, then others around its target, all at the same distance.

    Half of the other viewpoints are at the same height as the scene's own, and half are spread over the whole sphere.

    count: the number of views.
    start: the angle by which all views but the first are turned; a different angle gives different views [rad].
    largest: the longest side of the pictures [pixels].
    Errors: SceneError.
    """
    width, height = scene.film.size
    share = min(1.0, largest / max(width, height))
    size = (max(round(width * share), 1), max(round(height * share), 1))
    # Views are whole pictures with one sample a pixel, because a choice of settings has to hold for every part of the picture.
    film = scene.film.model_copy(update={"size": size, "samples": 1, "supersample": 1, "crop": None})
    scene = scene.model_copy(update={"film": film})
    assembly = assemble(scene)
    view, camera = assembly.view, scene.camera
    corners = np.concatenate([_corners(i.mesh.bounds - i.mesh.origin, i.world_from_object) for i in assembly.instances])
    low, high = corners.min(axis=0), corners.max(axis=0)
    backward = view.axes[2]
    # Without a target, the camera looks at the point on its axis that is nearest to the middle of the scene.
    along = float((view.eye - (low + high) / 2) @ backward)
    target = np.array(camera.target) if camera.target is not None else view.eye - along * backward
    distance = float(np.linalg.norm(view.eye - target))
    up = np.array(camera.up, dtype=np.float64) / np.linalg.norm(camera.up)
    own_height = float(backward @ up)
    views = [scene]
    for k in range(1, count):
        angle = start + k * GOLDEN
        z = own_height if k % 2 else 1 - 2 * ((k // 2 + start / math.pi) % (count / 2)) / (count / 2)
        direction = _around(backward, up, angle, z)
        kind = Perspective if view.perspective else Orthographic
        half = {"height": 2 * view.half_height}
        if view.perspective:
            half = {"fov": camera.fov if isinstance(camera, Perspective) else math.degrees(2 * math.atan(view.half_height))}
        moved = kind.model_validate({"eye": target + distance * direction, "target": target, "up": tuple(up), **half})
        views.append(scene.model_copy(update={"camera": moved}))
    return views


def _around(backward: Array, up: Array, angle: float, z: float) -> Array:
    """Returns a unit vector (3,): `backward` turned about `up`.

    backward, up: (3,), unit vectors.
    angle: the angle of the turn [rad].
    z: the component of the result along `up`.
    """
    # A camera straight above or below would have no defined up direction.
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
    """Returns the corners (8, 3) of a box in world space.

    bounds: (2, 3), the box's least and greatest corner in the space of its object.
    world: (4, 4), from the object's space to world space.
    """
    which = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    result: Array = bounds[which, np.arange(3)] @ world[:3, :3].T + world[:3, 3]
    return result
