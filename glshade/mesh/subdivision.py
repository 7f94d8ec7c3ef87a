"""Subdivision: a mesh cut finer without a change of shape, everywhere or only where its light asks for it.

Light per vertex is linear in between, so a lobe narrower than a triangle is missed. More vertices find it; new ones lie on
the flat triangles, with the normals, tangents and coordinates that interpolation gives there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.mesh.mesh import Mesh, normalised, weld

Array = NDArray[Any]
Light = Callable[[Mesh], Array]

# An edge is looked at in these places between its ends, so that a lobe which misses the middle is seen too.
PLACES = (0.25, 0.5, 0.75)
# Where cutting stops: 2^8 pieces an edge, and a mesh of four million triangles.
DEEPEST, LARGEST = 8, 4_000_000


def subdivided(mesh: Mesh, levels: int) -> Mesh:
    """Every triangle cut in four, `levels` times."""
    for _ in range(levels):
        edges = Edges.of(mesh)
        mesh = split(mesh, edges, np.ones(len(edges.ends), dtype=np.bool_))
    return mesh


def refined(mesh: Mesh, light: Light, tolerance: float) -> Mesh:
    """Cut where light interpolated between vertices is off by more than the tolerance.

    light(mesh) -> (V, C): what each vertex shows. An edge is cut where it is off at one of PLACES, all three of a triangle
    where its middle is. Few vertices go far: only what was cut is looked at again.
    """
    doubtful = np.ones(len(mesh.triangles), dtype=np.bool_)
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
        if not marked.any() or len(mesh.triangles) + 2 * int(marked.sum()) > LARGEST:
            break
        cut = marked[edges.sides].any(axis=1)
        mesh = split(mesh, edges, marked)
        # split() puts the pieces behind what stayed whole.
        doubtful = np.arange(len(mesh.triangles)) >= int((~cut).sum())
    return mesh


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a mesh. ends (E, 2): vertices. sides (T, 3): each triangle's edges, the first from its corner 0 to 1.

    place (E,): alike for edges between the same positions, which are cut together or not at all, so that nothing gapes.
    """

    ends: Array
    sides: Array
    place: Array

    @classmethod
    def of(cls, mesh: Mesh) -> Edges:
        """All of a mesh's."""
        corners = mesh.triangles.astype(np.int64)
        sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        keys, where = np.unique(sides[:, 0] << 32 | sides[:, 1], return_inverse=True)
        ends = np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1)
        spots = np.sort(weld(mesh.positions)[ends], axis=1)
        _, place = np.unique(spots[:, 0] << 32 | spots[:, 1], return_inverse=True)
        return cls(ends, where.reshape(-1, 3), place)

    def together(self, marked: Array) -> Array:
        """Marked, and those that lie on them."""
        some = np.zeros(int(self.place.max(initial=-1)) + 1, dtype=np.bool_)
        some[self.place[marked]] = True
        result: Array = some[self.place]
        return result


def split(mesh: Mesh, edges: Edges, marked: Array) -> Mesh:
    """The mesh with the marked (E,) edges cut in their middles: triangles in two, three or four. Whole ones come first."""
    number = np.cumsum(marked) - 1 + len(mesh.positions)
    middles = _points(mesh, edges.ends[marked], np.full((int(marked.sum()), 2), 0.5))
    corners, sides = mesh.triangles.astype(np.int64), edges.sides
    cut = marked[sides]
    count = cut.sum(axis=1)
    pieces = [corners[count == 0]]

    def turned(which: Array, first: Array) -> tuple[Array, Array]:
        """Corners and middles of the triangles, from side `first` on."""
        order = (first[:, None] + np.arange(3)) % 3
        rows = np.flatnonzero(which)[:, None]
        return corners[rows, order].T, number[sides[rows, order]].T

    one, two, three = (count == n for n in (1, 2, 3))
    (a, b, c), (m, _, _) = turned(one, np.argmax(cut[one], axis=1))
    pieces += [np.stack(t, axis=1) for t in ((a, m, c), (m, b, c))]
    # From the side that stays whole on: the corner opposite to it is cut off, and what is left has four corners.
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
    """A mesh without triangles whose vertices lie between others: corners, weights (N, k)."""

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
