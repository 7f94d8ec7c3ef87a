"""Topology: what the triangles of a mesh say about its edges, whatever the positions of its vertices are.

Meshes that follow each other in an animation have the same triangles. The search for their edges takes most of the time in
which a mesh is made ready, so that its result is kept for the next mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias
from weakref import WeakKeyDictionary
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Int64, UInt32
from glshade.lru import Lru
from glshade.mesh.geometry import Triangles, blocks
from glshade.mesh.welding import weld

Int32: TypeAlias = NDArray[np.int32]
Bool: TypeAlias = NDArray[np.bool_]

# Of the triangles that share one edge, each is compared with this many that follow it in the list. A mesh with more triangles
# at an edge is broken, and comparing all pairs would take quadratic time.
MOST_AT_AN_EDGE = 8
# The memory that a topology takes for each triangle [bytes], with everything that is computed from it.
PER_TRIANGLE = 160
# The limit of the cache of topologies [bytes]. A larger mesh, of more than 400,000 triangles, is never kept: its arrays would
# take more memory than the mesh itself.
KEPT = 64 << 20


@dataclass(frozen=True, eq=False)
class Corners:
    """The vertices of a mesh with smooth normals, as far as they do not depend on positions.

    smooth: (E,) which pairs of `Topology.pairs` are smooth edges.
    vertex: (V,) the label of the vertex of each old vertex; old vertices that differ in their index alone have one label.
    own: the number of triangles in the result.
    group: (3T,) the group of each corner. The corners of a group share a normal.
    count: the number of groups.
    source: (U,) the old vertex from which each new vertex takes its position, uvs and colour.
    label: (3 own,) the new vertex of each corner.
    which: (U,) the group of each new vertex.
    """

    smooth: Bool
    vertex: Int64
    own: int
    group: Int64
    count: int
    source: Int64
    label: Int64
    which: Int64


class Topology:
    """The edges of a mesh.

    triangles: (T, 3) the vertices of the triangles.
    place: (V,) the label of the position of each vertex; vertices at equal positions have one label.
    corners: the result of the last search for smooth normals; None before the first.
    """

    def __init__(self, triangles: UInt32, place: Int64) -> None:
        self.triangles = triangles
        self.place = place
        self.corners: Corners | None = None

    @cached_property
    def places(self) -> Int32:
        """(T, 3) the label of the position of each corner."""
        return self.place.astype(np.int32).take(self.triangles)

    @cached_property
    def is_closed(self) -> bool:
        """Whether every directed edge occurs once, and its reverse occurs once.

        Triangles with two corners at one place do not count.
        """
        return _is_closed(self.places)

    @cached_property
    def pairs(self) -> tuple[Int32, Int32]:
        """The pairs of edges that join the same two places, as two arrays (E,) of edges. Edge i starts at corner i.

        An edge without length has no partner.
        """
        tail, head = self.places.reshape(-1), self.places[:, [1, 2, 0]].reshape(-1)
        key = np.minimum(tail, head).astype(np.int64)
        key <<= 32
        key |= np.maximum(tail, head)
        order = np.argsort(key, kind="stable").astype(np.int32)
        key = key[order]
        long = (tail != head)[order]
        one, other = [], []
        for step in range(1, MOST_AT_AN_EDGE + 1):
            first = np.flatnonzero((key[step:] == key[:-step]) & long[step:])
            if not len(first):
                break
            for block in blocks(len(first)):
                one.append(order[first[block]])
                other.append(order[first[block] + step])
        empty = np.zeros(0, dtype=np.int32)
        return np.concatenate([empty, *one]), np.concatenate([empty, *other])


# mesh -> its topology, for as long as the mesh exists.
_of: WeakKeyDictionary[Triangles, Topology] = WeakKeyDictionary()
# (number of triangles, checksum of the triangles) -> the topology of the last mesh that had them.
_recent: Lru[tuple[int, int], Topology] = Lru(KEPT)


def topology_of(mesh: Triangles) -> Topology:
    """Returns the topology of a mesh: that of an earlier mesh, if both have the same triangles and the same equal positions.

    The topology of a large mesh is computed anew in each call, and not kept.
    """
    found = _of.get(mesh)
    if found is not None:
        return found
    place = weld(mesh.positions)
    size = PER_TRIANGLE * len(mesh.triangles)
    if size > KEPT:
        return Topology(mesh.triangles, place)
    key = len(mesh.triangles), crc32(np.ascontiguousarray(mesh.triangles).data)
    known = _recent.get(key)
    if known is None or not (np.array_equal(known.place, place) and np.array_equal(known.triangles, mesh.triangles)):
        known = _recent.put(key, Topology(mesh.triangles, place), size)
    _of[mesh] = known
    return known


def _is_closed(places: Int32) -> bool:
    """Returns whether every directed edge occurs once, and its reverse occurs once.

    places: (T, 3) the label of the position of each corner. Triangles with two equal labels do not count.
    """
    if not _is_balanced(places):
        return False
    flat = places.reshape(-1) == places[:, [1, 2, 0]].reshape(-1)
    if flat.any():
        places = places[~flat.reshape(-1, 3).any(axis=1)]
    tail, head = places.reshape(-1), places[:, [1, 2, 0]].reshape(-1)
    if len(tail) % 2 or not len(tail):
        return False
    # The lowest bit is the direction. Of a sorted list, each two neighbours must then be the two directions of one edge.
    key = np.minimum(tail, head).astype(np.uint64)
    key <<= np.uint64(32)
    key |= np.maximum(tail, head).astype(np.uint64) << np.uint64(1)
    key |= tail < head
    key.sort()
    paired = not (key[0::2] & np.uint64(1)).any() and np.array_equal(key[0::2] | np.uint64(1), key[1::2])
    return paired and bool((key[2::2] != key[:-2:2]).all())


def _is_balanced(places: Int32) -> bool:
    """Returns whether a sum over all directed edges is 0, to which the two directions of an edge contribute opposite numbers.

    An open mesh is told from a closed one by it in a tenth of the time of a sort. Where the sum is 0, a sort has to decide.
    places: (T, 3) the label of the position of each corner.
    """
    total = 0
    for block in blocks(len(places)):
        corners = [np.ascontiguousarray(column) for column in places[block].T]
        for tail, head in zip(corners, (corners[1], corners[2], corners[0]), strict=True):
            number = np.minimum(tail, head).astype(np.uint64) << np.uint64(32) | np.maximum(tail, head).astype(np.uint64)
            number *= np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: Fibonacci hashing
            number ^= number >> np.uint64(29)
            number *= np.uint64(6364136223846793005)  # the factor of Knuth's generator for MMIX
            total += int(number[tail < head].sum(dtype=np.uint64)) - int(number[tail > head].sum(dtype=np.uint64))
    return total % 2**64 == 0
