"""Geometry: bounding boxes, origins, areas, angles and normals of triangles, computed in float64."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Array, Float32, Float64, Int64, UInt32
from glshade.errors import AssetError
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


# The number of triangles whose coordinates are computed at a time. Their arrays fit into a processor's cache, which is several
# times as fast as arrays of all triangles, and takes no memory that grows with the mesh.
BLOCK = 1 << 15


def blocks(count: int) -> Iterator[slice]:
    """Yields slices of BLOCK elements, which cover 0 to count - 1."""
    return (slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK))


def by_corner(mesh: Triangles, centre: Float64 | None = None) -> Iterator[tuple[slice, list[list[Float64]]]]:
    """Yields the three corners of the triangles, each as a list of its coordinates x, y and z relative to `centre`.

    The triangles come in blocks, each with the slice of its triangles. A block is nine arrays instead of one of shape (n, 3,
    3), because NumPy is many times as fast along an axis of many elements as along one of three.
    """
    columns = [np.ascontiguousarray(column) for column in mesh.positions.T]
    offset = np.zeros(3) if centre is None else centre
    for block in blocks(len(mesh.triangles)):
        corners = mesh.triangles[block].astype(np.intp).T
        yield block, [[p.take(c).astype(np.float64) - o for p, o in zip(columns, offset, strict=True)] for c in corners]


# The normal of a vertex whose triangles all have no area. No pixel shows such a vertex, but values are evaluated there, and a
# unit vector keeps them finite.
FALLBACK_NORMAL = (0.0, 0.0, 1.0)


def face_normals(mesh: Triangles) -> Float64:
    """Returns (T, 3) unit normals, from the right-handed cross product of the edges of each triangle (lecture slide 55).

    The normal of a triangle without area is (0, 0, 0).
    """
    n = area_vectors(mesh)
    for block in blocks(len(n)):
        _make_unit(n[block])
    return n


def _make_unit(n: Float64) -> None:
    """Divides area vectors (N, 3) by their lengths. Those without a finite length become (0, 0, 0)."""
    with np.errstate(over="ignore"):
        length = np.sqrt(np.einsum("ij,ij->i", n, n))
    length[(length == 0) | ~np.isfinite(length)] = np.inf
    n /= length[:, None]


def area_vectors(mesh: Triangles) -> Float64:
    """Returns (T, 3): the unit normal of each triangle times twice its area.

    The edges need no scaling before their cross product, unlike in a shader: the fourth power of an edge between float32
    positions neither overflows nor vanishes in float64.
    """
    result = np.empty((len(mesh.triangles), 3))
    for block, corners in by_corner(mesh):
        result[block] = np.stack(_cross(corners), axis=1)
    return result


def has_area(mesh: Triangles) -> bool:
    """Returns whether any triangle has an area. It looks at no more triangles than it must."""
    return any(np.any(axis) for _, corners in by_corner(mesh) for axis in _cross(corners))


def corner_angles(mesh: Triangles) -> Float64:
    """Returns (T, 3) angles at the corners [rad]. They come from atan2, which is exact for very thin triangles too."""
    angles = np.empty((len(mesh.triangles), 3))
    for block, p in by_corner(mesh):
        _put_angles(angles[block], p, _cross(p))
    return angles


def normals_and_angles(mesh: Triangles) -> tuple[Float64, Float64]:
    """Returns what `face_normals` and `corner_angles` return, in two thirds of the time."""
    n, angles = np.empty((len(mesh.triangles), 3)), np.empty((len(mesh.triangles), 3))
    for block, p in by_corner(mesh):
        cross = _cross(p)
        _put_angles(angles[block], p, cross)
        n[block] = np.stack(cross, axis=1)
        _make_unit(n[block])
    return n, angles


def _put_angles(angles: Float64, p: list[list[Float64]], cross: list[Float64]) -> None:
    """Sets the angles (N, 3) at the corners p of triangles with the area vectors `cross`, both as in `by_corner`."""
    area = np.sqrt(sum(n * n for n in cross))
    for k in range(3):
        (x, y, z), (x1, y1, z1), (x2, y2, z2) = p[k], p[k - 2], p[k - 1]
        angles[:, k] = np.arctan2(area, (x1 - x) * (x2 - x) + (y1 - y) * (y2 - y) + (z1 - z) * (z2 - z))


def _cross(corners: list[list[Float64]]) -> list[Float64]:
    """Returns the cross product of two edges of each triangle, as a list of its coordinates. corners: as in `by_corner`."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
    x1, y1, z1 = bx - ax, by - ay, bz - az
    x2, y2, z2 = cx - ax, cy - ay, cz - az
    return [y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2]


def sum_by_label(values: Float64, label: Int64, count: int) -> Float64:
    """Returns (count, 3) sums. Row i is the sum of those rows of values (N, 3) whose label (N,) is i."""
    return np.stack([np.bincount(label, weights=values[:, k], minlength=count) for k in range(3)], axis=1)


def smooth_by_label(n: Float64, angle: Float64, label: Int64, count: int) -> Float64:
    """Returns unit normals (count, 3). Row i is the mean of the triangles' normals, weighted by angle, over the corners (3T,)
    whose label is i.

    n, angle: the normals (T, 3) of the triangles and the angles (T, 3) of their corners, as `normals_and_angles` returns them.

    Where the normals cancel out, the result is the normal of one of the triangles, or FALLBACK_NORMAL if all have no area.
    """
    total = np.empty((count, 3))
    for axis in range(3):
        total[:, axis] = np.bincount(label, weights=(angle * n[:, axis, None]).reshape(-1), minlength=count)
    result, length = normalised(total)
    # If the mean of a few unit vectors is shorter than 1e-7, it consists of rounding errors of float32 positions.
    lost = length <= 1e-7 * np.bincount(label, weights=angle.reshape(-1), minlength=count)
    if lost.any():
        stand_in = np.tile(np.array(FALLBACK_NORMAL), (count, 1))
        useful = np.flatnonzero(lost[label] & np.repeat(n.any(axis=1), 3))[::-1]
        stand_in[label[useful]] = n[useful // 3]
        result[lost] = stand_in[lost]
    return result


def in_use(count: int, *indices: UInt32 | None) -> NDArray[np.bool_]:
    """Returns which of `count` vertices the indices name (count,)."""
    used = np.zeros(count, dtype=np.bool_)
    for some in indices:
        if some is not None:
            used[some.reshape(-1)] = True
    return used


def centred(p: Array) -> tuple[Float64, Array]:
    """Returns the origin (3,) for positions p (V, 3), and the positions relative to it.

    The origin is the centre of the bounding box if that is farther from 0 than the box's diagonal is long, and otherwise 0.
    Errors: AssetError for positions that are too large for float32.
    """
    low, high = (corner.astype(np.float64) for corner in box(p))
    centre = low / 2 + high / 2  # the sum of two large numbers might overflow, so both are halved first
    with np.errstate(over="ignore"):
        far = np.linalg.norm(centre) > np.linalg.norm(high - low)
    if far:
        p = p.astype(np.float64) - centre
        low, high = box(p)
    reach = max(np.abs(low).max(), np.abs(high).max())
    if reach > np.finfo(np.float32).max:
        raise AssetError(f"positions reach {reach:g}, too large for float32")
    return (centre if far else np.zeros(3)), p
