"""Subdivision: cuts the triangles of a mesh without a change of its shape, everywhere or only where its light requires it.

Light that is computed per vertex is interpolated linearly over a triangle, so a highlight that is narrower than a triangle is
missed. More vertices make it visible. New vertices lie on the flat triangles and have interpolated normals, tangents, uvs and
colours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.mesh.mesh import Mesh
from glshade.mesh.welding import normalised, weld

Array = NDArray[Any]
Light = Callable[[Mesh], Array]

# The light on an edge is compared at these fractions of its length, so that a highlight beside its middle is found too.
PLACES = (0.25, 0.5, 0.75)
# Refinement ends after DEEPEST rounds, which cut an edge into 2^8 pieces, or before the mesh has more than LARGEST triangles.
DEEPEST, LARGEST = 8, 4_000_000


def subdivided(mesh: Mesh, levels: int) -> Mesh:
    """Returns the mesh with every triangle cut in four, `levels` times."""
    for _ in range(levels):
        edges = Edges.of(mesh)
        mesh = split(mesh, edges, np.ones(len(edges.ends), dtype=np.bool_))
    return mesh


def refined(mesh: Mesh, light: Light, tolerance: float, most: int | None = None) -> Mesh:
    """Returns the mesh, cut where the error of light that is interpolated between vertices exceeds the tolerance.

    light: a function that gives the light (V, C) at the vertices of a mesh, in C channels.
    tolerance: the largest error that is allowed, in the unit of the light.
    most: optional, the number of triangles at which refinement ends if it is below LARGEST.

    An edge is cut if the error at one of PLACES is too large. All three edges of a triangle are cut if the error at its middle
    is too large. Each round looks only at the triangles that the round before has cut.
    """
    doubtful = np.ones(len(mesh.triangles), dtype=np.bool_)
    most = LARGEST if most is None else min(most, LARGEST)
    for _ in range(DEEPEST):
        edges = Edges.of(mesh)
        shown = light(mesh)
        asked = np.unique(edges.sides[doubtful])
        marked = np.zeros(len(edges.ends), dtype=np.bool_)
        ends = edges.ends[asked]
        for place in PLACES:
            between = shown[ends[:, 0]] * (1 - place) + shown[ends[:, 1]] * place
            there = light(_points(mesh, ends, np.broadcast_to([1 - place, place], ends.shape)))
            marked[asked[np.abs(there - between).max(axis=1) > tolerance]] = True
        corners = mesh.triangles[doubtful].astype(np.intp)
        middle = light(_points(mesh, corners, np.full(corners.shape, 1 / 3)))
        off = np.abs(middle - shown[corners].mean(axis=1)).max(axis=1) > tolerance
        marked[edges.sides[doubtful][off]] = True
        marked = edges.together(marked)
        if not marked.any() or len(mesh.triangles) + 2 * int(marked.sum()) > most:
            break
        cut = marked[edges.sides].any(axis=1)
        mesh = split(mesh, edges, marked)
        # split() puts the pieces of cut triangles behind the triangles that were not cut.
        doubtful = np.arange(len(mesh.triangles)) >= int((~cut).sum())
    return mesh


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a mesh.

    ends: (E, 2) int64, the vertices at the two ends of each edge.
    sides: (T, 3) int64, the edges of each triangle. The first runs from its corner 0 to its corner 1.
    place: (E,) int64, a label that is equal for edges between the same positions. Such edges are cut together or not at all,
        so that the mesh gets no gaps.
    """

    ends: Array
    sides: Array
    place: Array

    @classmethod
    def of(cls, mesh: Mesh) -> Edges:
        """Returns all edges of a mesh."""
        corners = mesh.triangles.astype(np.int64)
        sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        keys, where = np.unique(sides[:, 0] << 32 | sides[:, 1], return_inverse=True)
        ends = np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1)
        spots = np.sort(weld(mesh.positions)[ends], axis=1)
        _, place = np.unique(spots[:, 0] << 32 | spots[:, 1], return_inverse=True)
        return cls(ends, where.reshape(-1, 3), place)

    def together(self, marked: Array) -> Array:
        """Returns marks (E,) for the edges of `marked` (E,) and for all other edges between the same positions."""
        some = np.zeros(int(self.place.max(initial=-1)) + 1, dtype=np.bool_)
        some[self.place[marked]] = True
        result: Array = some[self.place]
        return result


def split(mesh: Mesh, edges: Edges, marked: Array) -> Mesh:
    """Returns the mesh with the edges of `marked` (E,) cut at their middles. Their triangles become two, three or four pieces.

    The triangles that are not cut come first.
    """
    number = np.cumsum(marked) - 1 + len(mesh.positions)
    middles = _points(mesh, edges.ends[marked], np.full((int(marked.sum()), 2), 0.5))
    corners, sides = mesh.triangles.astype(np.int64), edges.sides
    cut = marked[sides]
    count = cut.sum(axis=1)
    pieces = [corners[count == 0]]

    def turned(which: Array, first: Array) -> tuple[Array, Array]:
        """Returns the corners of the chosen triangles and the middles of their sides, in the order from side `first` on."""
        order = (first[:, None] + np.arange(3)) % 3
        rows = np.flatnonzero(which)[:, None]
        return corners[rows, order].T, number[sides[rows, order]].T

    one, two, three = (count == n for n in (1, 2, 3))
    (a, b, c), (m, _, _) = turned(one, np.argmax(cut[one], axis=1))
    pieces += [np.stack(t, axis=1) for t in ((a, m, c), (m, b, c))]
    # These triangles start at the side that is not cut. The corner opposite to it is cut off, which leaves a quad.
    (a, b, c), (_, m, k) = turned(two, np.argmin(cut[two], axis=1))
    pieces += [np.stack(t, axis=1) for t in ((c, k, m), (a, b, m), (a, m, k))]
    (a, b, c), (k, m, n) = turned(three, np.zeros(int(three.sum()), dtype=np.intp))
    pieces += [np.stack(t, axis=1) for t in ((a, k, n), (k, b, m), (n, m, c), (k, m, n))]

    def joined(name: str) -> Array | None:
        one, other = getattr(mesh, name), getattr(middles, name)
        return None if one is None else np.concatenate([one, other])

    named: Any = {name: joined(name) for name in ("positions", "normals", "uvs", "tangents", "colours")}
    return Mesh(triangles=np.concatenate(pieces).astype(np.uint32), origin=mesh.origin, **named)


def _points(mesh: Mesh, corners: Array, weights: Array) -> Mesh:
    """Returns a mesh without triangles. Each of its N vertices is a weighted mean of k vertices of the given mesh.

    corners: (N, k) the vertices.
    weights: (N, k) their weights, which sum to 1.
    """

    def between(array: Array | None) -> Array | None:
        return None if array is None else np.einsum("nk,nkc->nc", weights, array[corners].astype(np.float64))

    normals, tangents = between(mesh.normals), between(mesh.tangents)
    if normals is not None:
        normals = normalised(normals)[0]
    if tangents is not None and normals is not None and mesh.tangents is not None:
        along = tangents[:, :3] - normals * np.einsum("ni,ni->n", normals, tangents[:, :3])[:, None]
        tangents = np.column_stack([normalised(along)[0], mesh.tangents[corners[:, 0], 3]])
    made: Any = {"normals": normals, "tangents": tangents, "uvs": between(mesh.uvs), "colours": between(mesh.colours)}
    positions: Any = between(mesh.positions)
    return Mesh(positions=positions, triangles=np.zeros((0, 3), dtype=np.uint32), origin=mesh.origin, **made)
