"""Cameras: converts pyrender's cameras into glshade's."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import SceneError
from glshade.scene.camera import Camera, Orthographic, Perspective, View

Array = NDArray[np.float64]
# The axes of a camera are unit and perpendicular. Their dot products may be wrong by this much, which is more than the error of
# a product of several float32 poses.
RIGID = 1e-4


class Pinhole(Perspective):
    """A perspective camera whose pixels need not be square and whose axis need not go through the middle of the picture.

    half: half the width and half the height of the picture at the distance 1.
    centre: x, y of the point where the axis meets the picture, as in View.
    """

    half: tuple[float, float]
    centre: tuple[float, float] = (0.0, 0.0)

    def half_size(self, aspect: float) -> tuple[float, float]:
        return self.half

    def view(self, points: Array, aspect: float) -> View:
        return replace(super().view(points, aspect), centre=self.centre)


def camera(given: Any, pose: Array, size: tuple[int, int]) -> Camera:
    """Returns pyrender's camera as a camera of glshade.

    given: a pyrender.Camera.
    pose: (4, 4), from the camera's space to world space.
    size: width, height of the picture [pixels].
    Errors: SceneError where the pose is scaled or sheared.
    """
    linear = pose[:3, :3]
    if not np.allclose(linear.T @ linear, np.eye(3), rtol=0, atol=RIGID):
        raise SceneError("the camera's pose is scaled or sheared; it may only rotate and move the camera")
    common: dict[str, Any] = {"matrix": affine_rows(pose), "near": given.znear or None, "far": given.zfar, "name": given.name}
    width, height = size
    if hasattr(given, "xmag"):
        # pyrender ignores xmag and computes the width from ymag and the shape of the picture.
        return Orthographic.model_validate({**common, "height": 2 * given.ymag})
    if hasattr(given, "fx"):
        half = (width / (2 * given.fx), height / (2 * given.fy))
        centre = (2 * given.cx / width - 1, 1 - 2 * given.cy / height)
        return Pinhole.model_validate({**common, "half": half, "centre": centre})
    if given.aspectRatio is None:
        return Perspective.model_validate({**common, "fov": math.degrees(given.yfov)})
    half_height = math.tan(given.yfov / 2)
    return Pinhole.model_validate({**common, "half": (given.aspectRatio * half_height, half_height)})


def affine_rows(matrix: Array) -> list[list[float]]:
    """Returns the rows of an affine matrix (4, 4). The last row is replaced by 0, 0, 0, 1, in case it has rounding errors."""
    rows: list[list[float]] = np.asarray(matrix, dtype=np.float64).tolist()
    return [*rows[:3], [0.0, 0.0, 0.0, 1.0]]
