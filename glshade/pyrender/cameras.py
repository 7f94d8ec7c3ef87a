"""Cameras: converts pyrender's cameras, and those of a program's own classes, into glshade's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.calibration.rotation import ROTATION
from glshade.errors import SceneError
from glshade.scene.camera import Camera, Intrinsics, Orthographic, Perspective

Array = NDArray[np.float64]
# The axes of a camera are unit and perpendicular. A pose whose dot products are off by more than this gets a warning. The limit
# is more than the error of a product of several float32 poses.
RIGID = 1e-4
# The largest cosine between two axes of a picture that are drawn as if they were perpendicular. Poses that were rounded to two
# decimals stay below it.
SHEAR = 0.02
# A far plane that is this many times farther than the near plane, or more, counts as infinitely far.
INFINITE = 1e6


class Projected(Intrinsics):
    """A camera that is known by its projection matrix.

    flipped: whether the picture is upside down, as seen by the pose. Front faces stay visible.
    depth_scale: the length of a scene unit in the units of pyrender's depth, which a scaled pose changes.
    planes: near and far plane with which pyrender converts the depth of an orthographic picture, as if it were a perspective
        one; None for a perspective camera.
    note: the warning about what the picture only approximates; empty if there is none.
    """

    flipped: bool = False
    depth_scale: float = 1.0
    planes: tuple[float, float | None] | None = None
    note: str = ""


def camera(given: Any, pose: Array, size: tuple[int, int]) -> Camera:
    """Returns a camera of pyrender, or of a class of the program's own, as a camera of glshade.

    given: a pyrender.Camera.
    pose: (4, 4), from the camera's space to world space.
    size: width, height of the picture [pixels].
    Errors: SceneError where glshade cannot draw the projection.
    """
    pose = np.asarray(pose, dtype=np.float64)
    off = float(np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max())
    has_matrix = hasattr(given, "get_projection_matrix")
    # A class of the program's own may inherit the attributes of pyrender's classes, but its matrix decides.
    if has_matrix and (not type(given).__module__.startswith("pyrender.") or not off <= ROTATION):
        return _projected(given, pose, size, off)
    if not off <= RIGID:
        raise SceneError("the camera's pose is scaled or sheared, and its class has no get_projection_matrix")
    common: dict[str, Any] = {"matrix": affine_rows(pose), "near": given.znear or None, "far": given.zfar, "name": given.name}
    width, height = size
    if hasattr(given, "xmag"):
        # pyrender ignores xmag and computes the width from ymag and the shape of the picture.
        return Orthographic.model_validate({**common, "height": 2 * given.ymag})
    if hasattr(given, "fx"):
        k = {key: getattr(given, key) for key in ("fx", "fy", "cx", "cy")}
        return Intrinsics.model_validate({**common, **k, "width": width, "height": height})
    if given.aspectRatio is None:
        return Perspective.model_validate({**common, "fov": math.degrees(given.yfov)})
    fy = height / (2 * math.tan(given.yfov / 2))
    k = {"fx": fy * width / height / given.aspectRatio, "fy": fy, "cx": width / 2, "cy": height / 2}
    return Intrinsics.model_validate({**common, **k, "width": width, "height": height})


def _projected(given: Any, pose: Array, size: tuple[int, int], off: float) -> Projected:
    """Returns the camera with a projection matrix. off: how far the columns of the pose are from unit and perpendicular ones.

    As in pyrender, the inverse of the pose leads from world space to the camera. The product of the two matrices holds the
    camera's axes and intrinsics (Hartley and Zisserman 2004, section 6.2.4).
    Errors: SceneError.
    """
    width, height = size
    projection = np.asarray(given.get_projection_matrix(width=width, height=height), dtype=np.float64)
    if projection.shape != (4, 4):
        raise SceneError(f"the camera's projection matrix has the shape {projection.shape}; it must be (4, 4)")
    with np.errstate(all="ignore"):
        product = projection @ np.linalg.inv(pose) if np.linalg.det(pose) else np.full((4, 4), np.nan)
    if not np.isfinite(product).all() or not np.linalg.matrix_rank(product) == 4:
        raise SceneError("the camera's pose or its projection matrix is singular, or holds a number that is not finite")
    perspective = bool(np.any(projection[3, :3]))
    weight = float(np.linalg.norm(product[3, :3])) if perspective else float(product[3, 3])
    if weight <= 0:
        raise SceneError("the camera's projection matrix has a negative last number, which puts all points behind the eye")
    rows = product / weight
    # The axis of an orthographic camera is the direction in which its depth grows.
    axis = rows[3, :3] if perspective else rows[2, :3] / np.linalg.norm(rows[2, :3])
    if _slant(rows[2, :3], axis) > SHEAR or (not perspective and max(_slope(row, axis) for row in rows[:2, :3]) > SHEAR):
        raise SceneError(
            "the camera's projection is oblique: its planes are not perpendicular to its axis; glshade cannot draw it"
        )
    across, up = (row - (row @ axis) * axis for row in rows[:2, :3])
    wide, tall = float(np.linalg.norm(across)), float(np.linalg.norm(up))
    if _slope(up, across / wide) > SHEAR:
        raise SceneError("the camera's projection or pose is sheared: the sides of its pixels are not perpendicular")
    right = across / wide
    above = np.cross(right, axis)
    if perspective:
        eye = np.linalg.solve(rows[[0, 1, 3], :3], -rows[[0, 1, 3], 3])
        centre = rows[:2, :3] @ axis
    else:
        eye = pose[:3, 3]
        centre = rows[:2, :3] @ eye + rows[:2, 3]
    flipped = float(up @ above) < 0
    if flipped:
        centre[1] = -centre[1]
    near, far = _planes(float(rows[2, :3] @ axis), float(rows[2, :3] @ eye + rows[2, 3]), perspective)
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = np.stack([right, above, -axis], axis=1), eye
    own_class = not type(given).__module__.startswith("pyrender.")
    return Projected.model_validate(
        {
            "name": getattr(given, "name", None),
            "projection": "perspective" if perspective else "orthographic",
            "matrix": world.tolist(),
            "near": near,
            "far": far,
            "fx": wide * width / 2,
            "fy": tall * height / 2,
            "cx": (1 + centre[0]) * width / 2,
            "cy": (1 - centre[1]) * height / 2,
            "width": width,
            "height": height,
            "flipped": flipped,
            "depth_scale": weight if perspective else 1 / float(np.linalg.norm(pose[:3, 2])),
            "planes": (given.znear, given.zfar) if own_class and not perspective else None,
            "note": ""
            if off <= RIGID
            else f"the camera's pose is off a rotation by {off:.1g}; as in pyrender, its inverse is used",
        }
    )


def _slope(vector: Array, axis: Array) -> float:
    """Returns the cosine of the angle between a vector (3,) and a unit axis (3,), without its sign."""
    return abs(float(vector @ axis)) / max(float(np.linalg.norm(vector)), 1e-300)


def _slant(vector: Array, axis: Array) -> float:
    """Returns the sine of the angle between a vector (3,) and a unit axis (3,)."""
    return float(np.linalg.norm(np.cross(vector, axis))) / max(float(np.linalg.norm(vector)), 1e-300)


def _planes(slope: float, offset: float, perspective: bool) -> tuple[float, float | None]:
    """Returns the depths of the near and the far plane [scene units]. An infinite far plane is None.

    slope, offset: clip-space z at the depth d is slope * d + offset.
    Errors: SceneError where the near plane is not in front of the far one.
    """
    far: float | None
    if perspective:
        near = -offset / (1 + slope) if slope != -1 else 0.0
        far = offset / (1 - slope) if abs(1 - slope) > 2 / INFINITE else None
    else:
        near, far = (-1 - offset) / slope, (1 - offset) / slope
    if (perspective and near <= 0) or (far is not None and far <= near):
        raise SceneError("the camera's projection matrix does not put its near plane in front of its far plane")
    return near, far


def affine_rows(matrix: Array) -> list[list[float]]:
    """Returns the rows of an affine matrix (4, 4). The last row is replaced by 0, 0, 0, 1, in case it has rounding errors."""
    rows: list[list[float]] = np.asarray(matrix, dtype=np.float64).tolist()
    return [*rows[:3], [0.0, 0.0, 0.0, 1.0]]
