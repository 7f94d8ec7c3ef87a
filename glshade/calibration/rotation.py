"""Rotation: matrices that rotate, their nearest neighbours, and quaternions."""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt

from glshade.arrays import Float64

# Turns the axes of OpenGL's cameras (x right, y up, looking along -z) into those of OpenCV's (x right, y down, looking along
# z), and back.
FLIPPED = np.diag([1.0, -1.0, -1.0, 1.0])
# A matrix is taken as a rotation where its numbers are this close to one: those of a float32 matrix are.
ROTATION = 1e-6


class CameraWarning(UserWarning):
    """A camera is drawn with other values than those it was given."""


def nearest_rotation(linear: npt.ArrayLike) -> tuple[Float64, float]:
    """Returns the rotation (3, 3) nearest to a matrix (3, 3), and how far the matrix is from it.

    The distance is the largest difference of two elements. The rotation minimises the sum of their squares (Schönemann 1966).
    Errors: ValueError for a matrix that mirrors or flattens space, or holds a number that is not finite.
    """
    matrix = np.asarray(linear, dtype=np.float64)
    if not np.isfinite(matrix).all():
        raise ValueError("it holds a number that is not finite")
    left, sizes, right = np.linalg.svd(matrix)
    # A matrix is taken as flat where one of its scales is this share of the largest or less.
    if sizes[2] <= 1e-9 * sizes[0]:
        raise ValueError("it flattens space")
    rotation: Float64 = left @ right
    if np.linalg.det(rotation) < 0:
        raise ValueError("it mirrors space")
    return rotation, float(np.abs(matrix - rotation).max())


def rigid(linear: npt.ArrayLike, where: str) -> Float64:
    """Returns a matrix (3, 3) that is close to a rotation; the nearest rotation, with a warning, for one of few digits.

    where: the name of the camera, with which the warning starts.
    Errors: ValueError, as of `nearest_rotation`.
    """
    rotation, distance = nearest_rotation(linear)
    if distance <= ROTATION:
        return np.array(linear, dtype=np.float64)
    message = f"{where}: its pose is off a rotation by {distance:.1g}; the nearest rotation is used"
    warnings.warn(message, CameraWarning, stacklevel=2)
    return rotation


def inverse_pose(pose: Float64) -> Float64:
    """Returns the inverse of a pose (4, 4): a rotation that is followed by a translation."""
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def pose_of(rotation: npt.ArrayLike, translation: npt.ArrayLike, where: str) -> Float64:
    """Returns the pose (4, 4) with a rotation (3, 3) and a translation (3,). where, errors: as for `rigid`."""
    result = np.eye(4)
    result[:3, :3] = rigid(rotation, where)
    result[:3, 3] = translation
    return result


def quaternion(rotation: Float64) -> Float64:
    """Returns the unit quaternion (w, x, y, z), with w >= 0, of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat(canonical=True)
    return np.array([w, x, y, z])


def rotation_of(wxyz: npt.ArrayLike) -> Float64:
    """Returns the rotation (3, 3) of a quaternion (w, x, y, z) of any length but 0. Errors: ValueError for length 0."""
    from scipy.spatial.transform import Rotation

    w, x, y, z = np.asarray(wxyz, dtype=np.float64)
    matrix: Float64 = Rotation.from_quat([x, y, z, w]).as_matrix()
    return matrix
