"""Cameras of pyrender, as cameras of glshade."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import SceneError
from glshade.scene.camera import Camera, Orthographic, Perspective, View

Array = NDArray[np.float64]
# How far the axes of a camera's pose may be from unit and perpendicular: float32 poses multiplied a few times.
RIGID = 1e-4


@dataclass(frozen=True, eq=False)
class OffCentre(View):
    """A view whose axis meets the picture at `centre`: x to the right, y up, the picture from -1 to 1."""

    centre: tuple[float, float] = (0.0, 0.0)

    def clip_from_world(self, zero_to_one: bool = True) -> Array:
        clip = super().clip_from_world(zero_to_one)
        # y points down in clip space.
        clip[0] += self.centre[0] * clip[3]
        clip[1] -= self.centre[1] * clip[3]
        return clip


class Pinhole(Perspective):
    """A pinhole by its projection matrix: pixels need not be square, nor the axis in the middle of the picture."""

    half: tuple[float, float]
    centre: tuple[float, float] = (0.0, 0.0)

    def half_size(self, aspect: float) -> tuple[float, float]:
        return self.half

    def view(self, points: Array, aspect: float) -> View:
        return OffCentre(**vars(super().view(points, aspect)), centre=self.centre)


def camera(given: Any, pose: Array, size: tuple[int, int]) -> Camera:
    """The camera of a pyrender camera at its pose (4, 4), for a picture of `size`. Errors: SceneError."""
    linear = pose[:3, :3]
    if not np.allclose(linear.T @ linear, np.eye(3), rtol=0, atol=RIGID):
        raise SceneError("the camera's pose is scaled or sheared; a camera can be turned and moved")
    where: dict[str, Any] = {"matrix": affine_rows(pose), "near": given.znear or None, "far": given.zfar, "name": given.name}
    width, height = size
    if hasattr(given, "xmag"):
        # As in pyrender, xmag follows from ymag and the picture's shape.
        return Orthographic.model_validate({**where, "height": 2 * given.ymag})
    if hasattr(given, "fx"):
        half = (width / (2 * given.fx), height / (2 * given.fy))
        centre = (2 * given.cx / width - 1, 1 - 2 * given.cy / height)
        return Pinhole.model_validate({**where, "half": half, "centre": centre})
    if given.aspectRatio is None:
        return Perspective.model_validate({**where, "fov": math.degrees(given.yfov)})
    half_height = math.tan(given.yfov / 2)
    return Pinhole.model_validate({**where, "half": (given.aspectRatio * half_height, half_height)})


def affine_rows(matrix: Array) -> list[list[float]]:
    """The rows of a (4, 4) matrix whose last may have rounding in it."""
    rows: list[list[float]] = np.asarray(matrix, dtype=np.float64).tolist()
    return [*rows[:3], [0.0, 0.0, 0.0, 1.0]]
