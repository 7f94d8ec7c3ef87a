"""Order: puts triangles and vertices in an order in which neighbours in space are neighbours in memory."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from glshade.arrays import UInt32
from glshade.mesh.geometry import box
from glshade.mesh.mesh import Mesh, gather

# A mesh with more triangles than this does not fit the caches of a processor, and its order begins to matter.
ORDERED_ABOVE = 1000

# The results of is_local.
_local: WeakKeyDictionary[Mesh, bool] = WeakKeyDictionary()


def is_local(mesh: Mesh) -> bool:
    """Returns whether the mesh has the order that `in_local_order` gives."""
    if mesh not in _local:
        _local[mesh] = _is_local(mesh)
    return _local[mesh]


def _is_local(mesh: Mesh) -> bool:
    corners = mesh.triangles.reshape(-1)
    if len(corners) == 0 or corners[0] != 0:
        return False
    highest = np.maximum.accumulate(corners)
    if highest[-1] + 1 != len(mesh.positions) or (corners[1:] > highest[:-1] + 1).any():
        return False
    place = _along_curve(mesh)
    return bool((place[1:] >= place[:-1]).all())


def in_local_order(mesh: Mesh) -> Mesh:
    """Returns the mesh with its triangles sorted along a Morton curve of their centroids, and its vertices in order of use.

    A software rasteriser then fetches each vertex from memory once instead of many times: a scattered mesh of a million
    triangles draws 2.5 times as fast. Vertices that no triangle uses are dropped. Of two triangles at equal
    depth the one that is drawn first is visible, so only coplanar triangles that overlap may look different.
    """
    if is_local(mesh):
        return mesh
    place = _along_curve(mesh)
    # Two radix sorts of 16 bits take half the time of one sort by comparison.
    order = np.argsort(place.astype(np.uint16), kind="stable")
    order = order[np.argsort((place >> np.uint32(16)).astype(np.uint16)[order], kind="stable")]
    corners = mesh.triangles[order].reshape(-1)
    first = np.empty(len(mesh.positions), dtype=np.int64)
    here = np.arange(len(corners))
    first[corners[::-1]] = here[::-1]  # the last write wins, so writing backwards keeps the first
    used = corners[first[corners] == here]
    number = np.empty(len(mesh.positions), dtype=np.uint32)
    number[used] = np.arange(len(used), dtype=np.uint32)
    local = gather(mesh, used, number[corners])
    _local[local] = True
    return local


def ordered(mesh: Mesh) -> Mesh:
    """Returns the mesh in local order if it has so many triangles that the order matters, and otherwise unchanged."""
    return in_local_order(mesh) if len(mesh.triangles) > ORDERED_ABOVE else mesh


def _along_curve(mesh: Mesh) -> UInt32:
    """Returns (T,): the place of each triangle's centroid on a Morton curve through the bounding box."""
    low, high = box(mesh.positions)
    size = float((high - low).max()) or 1.0
    a, b, c = mesh.triangles.astype(np.intp).T
    place = np.zeros(len(a), dtype=np.uint32)
    for axis in range(3):  # 10 bits an axis give a grid of 1024 cells, which is finer than the vertices of one cache line
        x = mesh.positions[:, axis] - low[axis]
        cell = ((x[a] + x[b] + x[c]) * np.float32(1023 / 3 / size)).astype(np.intp)
        place |= _SPREAD.take(cell, mode="clip") << np.uint32(axis)
    return place


def _spread(x: UInt32) -> UInt32:
    """Returns the low 10 bits of x, with two zero bits between each and the next."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        x = (x | x << np.uint32(shift)) & np.uint32(mask)
    return x


_SPREAD = _spread(np.arange(1024, dtype=np.uint32))
