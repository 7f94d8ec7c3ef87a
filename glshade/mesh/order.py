"""Order: puts triangles and vertices in an order in which neighbours in space are neighbours in memory."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from glshade.arrays import UInt32
from glshade.mesh.geometry import box
from glshade.mesh.mesh import Mesh, gather

# A mesh with more triangles than this does not fit the caches of a processor, and its order begins to matter.
ORDERED_ABOVE = 1000
# The numbers of triangles in a run, of vertices in a line, and of runs that `is_coherent` looks at. A processor fetches memory
# in lines of 64 bytes, which hold a few neighbouring vertices; 64 runs tell the mean of a mesh within a tenth.
RUN, LINE, RUNS = 32, 16, 64
# A mesh is coherent if a run of its triangles needs at most so many lines, and spans at most so many lengths of an edge. Grids,
# most subdivided meshes and lists of separate triangles need 4 to 18 lines and span 7 to 24 edges, and draw in their own order
# as fast as along a Morton curve. Meshes with shuffled vertices or triangles need 34 to 96 lines, and draw up to 2.5 times as
# fast along the curve. Of runs that span hundreds of edges, none is turned away from the viewer as a whole.
MOST_LINES, MOST_EDGES = 24, 32

# The place, in a run, of the corner that follows each corner of a triangle.
NEXT_CORNER = np.arange(3 * RUN).reshape(-1, 3)[:, [1, 2, 0]].reshape(-1)

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


def is_coherent(mesh: Mesh) -> bool:
    """Returns whether triangles that follow each other lie close together, both in space and in memory.

    It looks at some runs of triangles, evenly spaced over the mesh.
    """
    runs = mesh.triangles[: len(mesh.triangles) // RUN * RUN].reshape(-1, 3 * RUN)
    some = runs[np.linspace(0, len(runs) - 1, min(len(runs), RUNS)).astype(np.intp)]
    lines = np.sort(some // LINE, axis=1)
    if 1 + (lines[:, 1:] != lines[:, :-1]).sum(axis=1).mean() > MOST_LINES:
        return False
    span, edge = np.zeros(len(some)), np.zeros(some.shape)
    for axis in range(3):  # NumPy is slow along an axis of three
        x = mesh.positions[some, axis].astype(np.float64)
        span += np.square(x.max(axis=1) - x.min(axis=1))
        edge += np.square(x - x[:, NEXT_CORNER])
    return bool(np.sqrt(span).mean() <= MOST_EDGES * np.sqrt(edge).mean())


def ordered(mesh: Mesh) -> Mesh:
    """Returns the mesh in local order if it has so many triangles that the order matters, unless its own order is coherent."""
    if len(mesh.triangles) <= ORDERED_ABOVE or is_coherent(mesh):
        return mesh
    return in_local_order(mesh)


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
