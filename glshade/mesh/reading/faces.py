"""Faces: cuts many polygons and triangle strips into triangles at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from glshade.arrays import Array, Float64, Int64
from glshade.mesh.reading.polygon import triangulated

# The corners of polygons that are examined at once. Their positions and edges take about 200 bytes each.
_BLOCK = 1 << 16
# A corner counts as convex up to this turn inward, relative to the square of twice the polygon's area. Corners on a straight
# side, whose positions were rounded to float32, turn inward by about 1e-7.
_STRAIGHT = 1e-6


def cut(corners: Array, counts: Array, positions: Float64) -> tuple[Int64, Int64]:
    """Cuts polygons into triangles, in the order of the polygons.

    corners: (C,) the vertex indices of all polygons, one polygon after another. They must be in range.
    counts: (P,) the number of corners of each polygon. Polygons with fewer than three give no triangle.
    positions: (V, 3) the positions of the vertices, which decide how a polygon that is not convex is cut.

    Returns the triangles (T, 3), as indices into `corners`, and the polygon (T,) of each. They keep the polygons' orientation.
    Errors: ValueError for a polygon that `triangulated` refuses.
    """
    counts = np.asarray(counts, dtype=np.int64)
    starts = np.cumsum(counts) - counts
    triangles, owners = [np.empty((0, 3), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    count: int
    for count in np.unique(counts[counts >= 3]).tolist():
        chosen = np.flatnonzero(counts == count)
        step = max(_BLOCK // count, 1)
        for first in range(0, len(chosen), step):
            block = chosen[first : first + step]
            for local, polygons in _cut_alike(corners[starts[block, None] + np.arange(count)], positions):
                triangles.append((starts[block[polygons], None, None] + local).reshape(-1, 3))
                owners.append(np.repeat(block[polygons], count - 2))
    triangle, owner = np.concatenate(triangles), np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return triangle[order], owner[order]


def _cut_alike(polygons: Array, positions: Float64) -> Iterator[tuple[Int64, Int64]]:
    """Yields triangles (k, n - 2, 3), as indices of corners, and the indices (k,) of the polygons that they cut.

    polygons: (P, n) the vertex indices of polygons with the same number of corners n.
    """
    count = polygons.shape[1]
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)], dtype=np.int64)
    if count == 3:
        yield np.broadcast_to(fan, (len(polygons), 1, 3)), np.arange(len(polygons))
        return
    inward = _inward(positions[polygons])
    # A quad can be cut along the diagonal that ends in its only corner that turns inward.
    simple = ~(inward[:, 1::2] if count == 4 else inward).any(axis=1)
    yield np.broadcast_to(fan, (int(simple.sum()), count - 2, 3)), np.flatnonzero(simple)
    others = np.flatnonzero(~simple)
    if count == 4:
        yield np.broadcast_to(np.array([(1, 2, 3), (1, 3, 0)]), (len(others), 2, 3)), others
        return
    for polygon in others:
        yield np.array([triangulated(positions[polygons[polygon]])], dtype=np.int64), np.array([polygon])


def _inward(outlines: Float64) -> Array:
    """Returns (P, n) bool: at which corners the outlines (P, n, 3) turn inward.

    An outline with a position that is not finite has no such corner, because no cut would be better than another.
    """
    with np.errstate(all="ignore"):
        rays = outlines - outlines[:, :1]
        # Twice the area along the normal, for any outline (Newell).
        normals = np.cross(rays, np.roll(rays, -1, axis=1)).sum(axis=1)
        edges = np.roll(outlines, -1, axis=1) - outlines
        turns = np.einsum("pnk,pk->pn", np.cross(np.roll(edges, 1, axis=1), edges), normals)
        square = np.sum(normals**2, axis=1)
    result: Array = (turns < -_STRAIGHT * square[:, None]) & np.isfinite(square)[:, None]
    return result


def strips(order: Array) -> Int64:
    """Returns the triangles (T, 3) of triangle strips, as indices into `order`.

    order: (N,) vertex indices; a negative number ends a strip. Every second triangle of a strip is reversed, so that all have
        the orientation of the first. Triangles with two equal corners, which only connect parts of a strip, are left out.
    """
    order = np.asarray(order)
    if len(order) < 3:
        return np.empty((0, 3), dtype=np.int64)
    at = np.arange(len(order) - 2)
    # The position after the last end of a strip is the start of the strip to which each position belongs.
    starts = np.maximum.accumulate(np.where(order < 0, np.arange(len(order)) + 1, 0))[:-2]
    a, b, c = order[:-2], order[1:-1], order[2:]
    drawn = (a >= 0) & (b >= 0) & (c >= 0) & (a != b) & (b != c) & (c != a)
    odd = (at - starts) % 2
    result: Int64 = np.column_stack([at + odd, at + 1 - odd, at + 2])[drawn]
    return result
