"""Surface: builds the parts of one surface, across whose borders normals are smooth, such as faces of several materials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from glshade.arrays import Array, Float32, Int64
from glshade.errors import AssetError
from glshade.mesh.checking import Arrays, Faults, checked, nothing_finite
from glshade.mesh.geometry import centred, has_area
from glshade.mesh.mesh import Mesh
from glshade.mesh.welding import weld
from glshade.mesh.winding import against_normals

# A place at which more parts meet than this gets no neighbours. The neighbours of all places then take time and memory that
# grow with the number of triangles alone, and a ball with 64 stripes is still smooth at its poles.
MOST_PARTS = 64


def build_surface(parts: Sequence[Mapping[str, Any]], faults: Faults) -> list[Mesh | None]:
    """Returns the meshes of the parts of one surface; None for a part of which no triangle has finite positions.

    Positions are at one place if they are exactly equal. All meshes get the same origin, and a part without normals gets those
    triangles of the other parts that touch it as its `Mesh.neighbours`.

    parts: the arguments of `Mesh.build` by name, for each part.
    faults: counts what is left out or replaced.
    Errors: those of `Mesh.build`.
    """
    arrays = [checked(**part, faults=faults) for part in parts]
    kept = [a for a in arrays if a is not None]
    if not kept:
        raise AssetError(nothing_finite(faults))
    if len(kept) == 1:
        meshes = iter([Mesh.of_arrays(kept[0], *centred(kept[0].positions))])
    else:
        origin, positions = centred(np.concatenate([a.positions for a in kept]))
        first = np.cumsum([0, *(len(a.positions) for a in kept)])
        relative = positions.astype(np.float32, copy=False)
        corners = np.concatenate([a.triangles.astype(np.int64) + f for a, f in zip(kept, first[:-1], strict=True)])
        part = np.repeat(np.arange(len(kept)), [len(a.triangles) for a in kept])
        near = _neighbours(weld(relative)[corners], part, len(kept))
        groups = _groups(kept)
        meshes = iter(
            [
                Mesh.of_arrays(a, origin, relative[f:g], *_around(relative, corners, n, None if groups is None else groups[n]))
                for a, f, g, n in zip(kept, first[:-1], first[1:], near, strict=True)
            ]
        )
    return [None if a is None else _compared(next(meshes), a, faults) for a in arrays]


def _compared(mesh: Mesh, arrays: Arrays, faults: Faults) -> Mesh:
    """Returns the mesh, after its areas were looked at, and its normals were compared with its winding."""
    faults.visible = faults.visible or has_area(mesh)
    if arrays.normals is not None:
        faults.with_normals += len(mesh.triangles)
        faults.against += int(against_normals(mesh).sum())
    return mesh


def _around(relative: Float32, corners: Int64, near: Int64, groups: Array | None) -> tuple[Float32 | None, Array | None]:
    """Returns the positions (N, 3, 3) of the triangles `near` (N,), and their smoothing groups; None where there are none."""
    return (relative[corners[near]], groups) if len(near) else (None, None)


def _groups(parts: list[Arrays]) -> Array | None:
    """Returns the smoothing groups (T,) of the triangles of all parts; None if no part has any.

    A triangle of a part without groups is in none.
    """
    if all(a.smoothing is None for a in parts):
        return None
    return np.concatenate([np.zeros(len(a.triangles), np.int64) if a.smoothing is None else a.smoothing for a in parts])


def _neighbours(place: Int64, part: Int64, count: int) -> list[Int64]:
    """Returns the triangles (N,) of other parts that touch each part at a place.

    place: (T, 3) the label of the position of each corner.
    part: (T,) the part of each triangle, in ascending order.
    count: the number of parts.
    """
    corner_part = np.repeat(part, 3)
    # Every place is listed with the parts that meet there, in the order of the places.
    met = np.unique(place.reshape(-1) << 32 | corner_part)
    parts_there = np.bincount(met >> 32)
    begins = np.cumsum(parts_there) - parts_there
    border = (parts_there > 1) & (parts_there <= MOST_PARTS)
    corner = np.flatnonzero(border[place.reshape(-1)])
    where = place.reshape(-1)[corner]
    # Each corner at a border is handed to each of the parts that meet there, except its own.
    times = parts_there[where]
    steps = np.arange(int(times.sum())) - np.repeat(np.cumsum(times) - times, times)
    to = met[np.repeat(begins[where], times) + steps] & 0xFFFFFFFF
    corner = np.repeat(corner, times)
    other = to != corner_part[corner]
    pairs = np.unique(to[other] << 32 | corner[other] // 3)
    ends = np.searchsorted(pairs >> 32, np.arange(count + 1))
    return [pairs[a:b] & 0xFFFFFFFF for a, b in pairwise(ends)]
