"""Geometry: bounding boxes, areas, angles and normals of triangles, computed in float64."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from glshade.arrays import Array, Float32, Float64, Int64, UInt32
from glshade.mesh.welding import normalised


class Triangles(Protocol):
    """The arrays of a mesh that this module reads."""

    @property
    def positions(self) -> Float32:
        """(V, 3) positions of the vertices."""

    @property
    def triangles(self) -> UInt32:
        """(T, 3) indices of vertices."""


def box(p: Array) -> tuple[Array, Array]:
    """Returns the least and the greatest corner (3,) of the bounding box of positions p (V, 3)."""
    columns = [p[:, axis] for axis in range(3)]  # one column at a time is ten times as fast as p.min(axis=0)
    return np.array([x.min() for x in columns]), np.array([x.max() for x in columns])


def by_corner(mesh: Triangles, centre: Float64 | float = 0.0) -> list[list[Float64]]:
    """Returns the three corners of all triangles, each as a list of its coordinates x, y and z (T,) relative to `centre`.

    The result is nine arrays instead of one of shape (T, 3, 3), because NumPy is many times as fast along an axis of a million
    elements as along one of three.
    """
    p = np.ascontiguousarray((mesh.positions.astype(np.float64) - centre).T)
    return [[p[axis][corner] for axis in range(3)] for corner in mesh.triangles.astype(np.intp).T]


# The normal of a vertex whose triangles all have no area. No pixel shows such a vertex, but values are evaluated there, and a
# unit vector keeps them finite.
FALLBACK_NORMAL = (0.0, 0.0, 1.0)


def face_normals(mesh: Triangles) -> Float64:
    """Returns (T, 3) unit normals, from the right-handed cross product of the edges of each triangle (lecture slide 55).

    The normal of a triangle without area is (0, 0, 0).
    """
    n = area_vectors(mesh)
    with np.errstate(over="ignore"):
        length = np.sqrt(np.einsum("ij,ij->i", n, n))
    length[(length == 0) | ~np.isfinite(length)] = np.inf
    n /= length[:, None]
    return n


def area_vectors(mesh: Triangles) -> Float64:
    """Returns (T, 3): the unit normal of each triangle times twice its area.

    The edges need no scaling before their cross product, unlike in a shader: the fourth power of an edge between float32
    positions neither overflows nor vanishes in float64.
    """
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = by_corner(mesh)
    x1, y1, z1 = bx - ax, by - ay, bz - az
    x2, y2, z2 = cx - ax, cy - ay, cz - az
    result = np.empty((len(ax), 3))
    result[:, 0] = y1 * z2 - z1 * y2
    result[:, 1] = z1 * x2 - x1 * z2
    result[:, 2] = x1 * y2 - y1 * x2
    return result


def corner_angles(mesh: Triangles) -> Float64:
    """Returns (T, 3) angles at the corners [rad]. They come from atan2, which is exact for very thin triangles too."""
    p = by_corner(mesh)
    area = np.linalg.norm(area_vectors(mesh), axis=1)
    angles = np.empty((len(area), 3))
    for k in range(3):
        (x, y, z), (x1, y1, z1), (x2, y2, z2) = p[k], p[k - 2], p[k - 1]
        angles[:, k] = np.arctan2(area, (x1 - x) * (x2 - x) + (y1 - y) * (y2 - y) + (z1 - z) * (z2 - z))
    return angles


def sum_by_label(values: Float64, label: Int64, count: int) -> Float64:
    """Returns (count, 3) sums. Row i is the sum of those rows of values (N, 3) whose label (N,) is i."""
    return np.stack([np.bincount(label, weights=values[:, k], minlength=count) for k in range(3)], axis=1)


def smooth_by_label(mesh: Triangles, label: Int64, count: int) -> Float64:
    """Returns unit normals (count, 3). Row i is the mean of the triangles' normals, weighted by angle, over the corners (3T,)
    whose label is i.

    Where the normals cancel out, the result is the normal of one of the triangles, or FALLBACK_NORMAL if all have no area.
    """
    n = face_normals(mesh)
    angle = corner_angles(mesh).reshape(-1)
    corner = np.repeat(n, 3, axis=0)
    result, length = normalised(sum_by_label(corner * angle[:, None], label, count))
    # If the mean of a few unit vectors is shorter than 1e-7, it consists of rounding errors of float32 positions.
    lost = length <= 1e-7 * np.bincount(label, weights=angle, minlength=count)
    if lost.any():
        stand_in = np.tile(np.array(FALLBACK_NORMAL), (count, 1))
        useful = np.flatnonzero(lost[label] & corner.any(axis=1))[::-1]
        stand_in[label[useful]] = corner[useful]
        result[lost] = stand_in[lost]
    return result
