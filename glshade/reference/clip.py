"""Clip: clips triangles to the view volume in homogeneous coordinates (OpenGL 4.6 core, 13.7).

Only coverage uses the clipped polygons. Attributes are interpolated over the whole triangle (interpolate.py), with the same
result.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# A point is inside a plane where plane . (x, y, z, w) >= 0. The order is left, right, top, bottom (y points down, as in the
# picture), far (depth 0) and near (depth 1).
PLANES = np.array([[1, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, -1, 1]], dtype=np.float64)
# The bits of the outcode that stand for the near and the far plane.
DEPTH = 0b110000
# The size of the guard band: a triangle is clipped at the left, right, top and bottom only if it reaches beyond this multiple
# of the view. Clipping would move the triangle's edges, because its new corners are snapped too. Drivers also have a guard
# band.
GUARD = 2.0
GUARDED = np.array([[1, 0, 0, GUARD], [-1, 0, 0, GUARD], [0, 1, 0, GUARD], [0, -1, 0, GUARD]], dtype=np.float64)


def outside(clip: Array, planes: Array = PLANES) -> NDArray[np.uint8]:
    """Returns the outcodes of points in clip space, in the points' leading shape: bit i is set where a point lies outside of
    plane i.

    clip: the points (..., 4), with any leading shape.
    planes: the planes (P, 4).
    """
    code = np.zeros(clip.shape[:-1], dtype=np.uint8)
    for bit, plane in enumerate(planes):
        distance = sum(plane[i] * clip[..., i] for i in np.flatnonzero(plane))
        # A point counts as outside if its distance is not >= 0. This includes NaN, which `< 0` would not.
        code |= (~(distance >= 0)).astype(np.uint8) << np.uint8(bit)
    return code


def cut(triangles: Array) -> tuple[Array, NDArray[np.intp]]:
    """Returns the parts of triangles (N, 3, 4) inside all planes: (convex polygons (N, 9, 4), their numbers of corners (N,)).

    A polygon of fewer than 9 corners repeats its last one; the corners of an empty polygon have no meaning. The algorithm is
    that of Sutherland and Hodgman 1974.
    """
    polygons, counts = triangles, np.full(len(triangles), 3)
    for plane in PLANES:
        polygons, counts = _cut_by(polygons, counts, plane)
    return polygons, counts


def _cut_by(polygons: Array, counts: NDArray[np.intp], plane: Array) -> tuple[Array, NDArray[np.intp]]:
    """Returns the parts of polygons (N, E, 4) inside one plane: (polygons (N, E + 1, 4), their numbers of corners (N,))."""
    number, size, _ = polygons.shape
    slot = np.arange(size)
    used = slot < counts[:, None]
    following = np.where(slot + 1 < counts[:, None], slot + 1, 0)
    after = np.take_along_axis(polygons, following[..., None], axis=1)
    distance, next_distance = polygons @ plane, after @ plane
    inside = distance >= 0
    crossing = used & (inside != (next_distance >= 0))
    # The cut is computed from the edge's inner end, so that two triangles which share the edge are cut at the same point.
    inner, outer = np.where(inside[..., None], polygons, after), np.where(inside[..., None], after, polygons)
    t = np.where(inside, distance, next_distance) / np.where(crossing, np.abs(distance - next_distance), 1.0)
    cuts = inner + t[..., None] * (outer - inner)
    # The result has each corner that is inside, followed by the cut of the edge that starts at it, if there is one.
    candidates = np.stack([polygons, cuts], axis=2).reshape(number, 2 * size, 4)
    kept = np.stack([used & inside, crossing], axis=2).reshape(number, 2 * size)
    place = np.cumsum(kept, axis=1) - 1
    left = kept.sum(axis=1)
    result = np.zeros((number, size + 1, 4))
    rows, columns = np.nonzero(kept)
    result[rows, place[rows, columns]] = candidates[rows, columns]
    last: Any = np.minimum(np.arange(size + 1), np.maximum(left, 1)[:, None] - 1)
    return np.take_along_axis(result, last[..., None], axis=1), left
