"""Camera: the viewer's place, and where points of the world lie in the picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from support.third.vectors import Array, unit


@dataclass(frozen=True)
class View:
    """A camera at its place.

    eye: position of the viewer (3,) [scene units].
    axes: the unit directions right, up and forward as rows (3, 3), in world space.
    half: half the width and half the height of the picture (2,), at depth 1 if perspective [scene units].
    perspective: whether the view is perspective; else it is orthographic.
    near, far: the depths between which surfaces are seen [scene units].
    """

    eye: Array
    axes: Array
    half: Array
    perspective: bool
    near: float
    far: float

    def projected(self, points: Array) -> tuple[Array, Array]:
        """Returns the homogeneous places (..., 3) of world points (..., 3) in the picture, and their depths (...).

        A point on the ray through the place q has a homogeneous place that is a positive multiple of q = (x, y, 1).
        """
        local = (points - self.eye) @ self.axes.T
        depth = local[..., 2].copy()
        if not self.perspective:
            local[..., 2] = 1.0
        return local, depth

    def pixels(self, size: tuple[int, int]) -> Array:
        """Returns the homogeneous places (width height, 3) of the pixels' centres, row by row from the top."""
        (width, height), (half_width, half_height) = size, self.half
        x = ((np.arange(width) + 0.5) / width * 2 - 1) * half_width
        y = (1 - (np.arange(height) + 0.5) / height * 2) * half_height
        return np.stack([np.tile(x, height), np.repeat(y, width), np.ones(width * height)], axis=1)

    def toward_viewer(self, p: Array) -> Array:
        """Returns the unit directions (N, 3) from world points p (N, 3) to the viewer."""
        return unit(self.eye - p) if self.perspective else np.broadcast_to(-self.axes[2], p.shape)


def view_of(camera: Mapping[str, Any], size: tuple[int, int]) -> View:
    """Returns the view of a camera that has an eye and a target, or a matrix.

    size: width and height of the picture [pixels].
    """
    up = np.array(camera.get("up", (0, 1, 0)), dtype=np.float64)
    if "matrix" in camera:
        matrix = np.array(camera["matrix"], dtype=np.float64)
        eye, forward, raised = matrix[:3, 3], unit(-matrix[:3, 2]), matrix[:3, 1]
    else:
        eye, target = np.array(camera["eye"], dtype=np.float64), np.array(camera["target"], dtype=np.float64)
        turned = _about(up, camera.get("turn", 0.0))
        eye = target + turned @ (eye - target)
        forward, raised = unit(target - eye), up
    right = unit(np.cross(forward, raised))
    perspective = camera.get("type", "perspective") == "perspective"
    half = math.tan(math.radians(camera.get("fov", 40.0)) / 2) if perspective else camera["height"] / 2
    return View(
        eye,
        np.stack([right, np.cross(right, forward), forward]),
        np.array([half * size[0] / size[1], half]),
        perspective,
        camera.get("near", 0.0 if perspective else -math.inf),
        camera.get("far", math.inf),
    )


def _about(axis: Array, degrees: float) -> Array:
    """Returns the matrix (3, 3) of a right-handed turn about an axis (3,)."""
    first = unit(np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))]))
    frame = np.stack([first, np.cross(unit(axis), first), unit(axis)])
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return frame.T @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ frame
