"""Clip: triangles cut to the view, in homogeneous coordinates. OpenGL 4.6 core, 13.7.

Coverage alone needs it: attributes are interpolated over the whole triangle (interpolate.py), which is the same for any cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Inside is where plane . (x, y, z, w) >= 0: left, right, top, bottom, far (depth 0), near (depth 1).
PLANES = np.array([[1, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, -1, 1]], dtype=np.float64)
# Sideways a triangle is left whole as long as it stays within this many pictures of the middle: cutting it would move its
# edges, since the new corners are snapped too, and drivers do not either.
GUARD = 2.0
GUARDED = np.array([[1, 0, 0, GUARD], [-1, 0, 0, GUARD], [0, 1, 0, GUARD], [0, -1, 0, GUARD]], dtype=np.float64)


def outside(clip: Array, planes: Array = PLANES) -> NDArray[np.uint8]:
    """(...,): which planes the points (..., 4) lie outside of, one bit each."""
    code = np.zeros(clip.shape[:-1], dtype=np.uint8)
    for bit, plane in enumerate(planes):
        distance = sum(plane[i] * clip[..., i] for i in np.flatnonzero(plane))
        # Written so that what is not a number is outside.
        code |= (~(distance >= 0)).astype(np.uint8) << np.uint8(bit)
    return code


def cut(triangles: Array) -> tuple[Array, NDArray[np.intp]]:
    """What is left of triangles (N, 3, 4) inside all planes: (N, 9, 4) convex polygons and their counts of corners (N,).

    A polygon of fewer corners repeats its last; one of none holds nothing of use. Sutherland and Hodgman 1974.
    """
    polygons, counts = triangles, np.full(len(triangles), 3)
    for plane in PLANES:
        polygons, counts = _cut_by(polygons, counts, plane)
    return polygons, counts


def _cut_by(polygons: Array, counts: NDArray[np.intp], plane: Array) -> tuple[Array, NDArray[np.intp]]:
    number, size, _ = polygons.shape
    slot = np.arange(size)
    used = slot < counts[:, None]
    following = np.where(slot + 1 < counts[:, None], slot + 1, 0)
    after = np.take_along_axis(polygons, following[..., None], axis=1)
    here, there = polygons @ plane, after @ plane
    inside = here >= 0
    crossing = used & (inside != (there >= 0))
    # From the inner end always, so that an edge is cut at the same place for both its triangles.
    inner, outer = np.where(inside[..., None], polygons, after), np.where(inside[..., None], after, polygons)
    t = np.where(inside, here, there) / np.where(crossing, np.abs(here - there), 1.0)
    cuts = inner + t[..., None] * (outer - inner)
    # Each corner leaves itself, a cut, both or nothing.
    candidates = np.stack([polygons, cuts], axis=2).reshape(number, 2 * size, 4)
    kept = np.stack([used & inside, crossing], axis=2).reshape(number, 2 * size)
    place = np.cumsum(kept, axis=1) - 1
    left = kept.sum(axis=1)
    result = np.zeros((number, size + 1, 4))
    rows, columns = np.nonzero(kept)
    result[rows, place[rows, columns]] = candidates[rows, columns]
    last: Any = np.minimum(np.arange(size + 1), np.maximum(left, 1)[:, None] - 1)
    return np.take_along_axis(result, last[..., None], axis=1), left
