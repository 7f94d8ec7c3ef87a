"""Fans: finds which corners of triangles share a normal, and splits vertices that need several normals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Array, Float64, Int64
from glshade.mesh.geometry import Triangles, blocks, face_normals, smooth_by_label
from glshade.mesh.welding import weld

Int32: TypeAlias = NDArray[np.int32]
Bool: TypeAlias = NDArray[np.bool_]
# A rule takes two arrays of triangles (N,) that share an edge, and returns whether the surface is smooth across it (N,).
Rule: TypeAlias = Callable[[Array, Array], Bool]

# An edge counts as sharp if it bends by more than the threshold minus this [degrees]. A file with six digits turns a face that
# is a hundredth of the mesh in size by up to 0.006 degrees. The result for an edge at the threshold must not depend on that.
# For the same reason, an edge that bends by less than this is flat, and smooth at any threshold.
THRESHOLD_SLACK = 0.01
# A triangle without area has no normal. Its edges count as bent by 90 degrees, for which the square of the chord is this.
CHORD2_OF_FLAT = 2.0
# Of the triangles that share one edge, each is compared with this many that follow it in the list. A mesh with more triangles
# at an edge is broken, and comparing all pairs would take quadratic time.
MOST_AT_AN_EDGE = 8


@dataclass(frozen=True, eq=False)
class Split:
    """The vertices of a mesh with smooth normals.

    source: (V,) the old vertex from which each new vertex takes its position, uvs and colour.
    corners: (3T,) the new vertex of each corner.
    normals: (V, 3) the unit normals of the new vertices.
    """

    source: Int64
    corners: Int64
    normals: Float64


def bent_less(faces: Float64, threshold: float) -> Rule:
    """Returns the rule that an edge is smooth if the normals of its two triangles differ by less than the threshold.

    faces: (T, 3) the unit normals of the triangles; zero for a triangle without area.
    threshold: an angle [degrees]. At 180 every edge is smooth.

    Angles are compared by the chord between unit normals, |n1 - n2| = 2 sin(angle / 2). Unlike the cosine, the chord is exact
    for small angles.
    """
    if threshold >= 180:
        return lambda one, other: np.ones(len(one), dtype=np.bool_)
    largest = 4 * np.sin(np.radians(max(threshold - THRESHOLD_SLACK, THRESHOLD_SLACK)) / 2) ** 2

    def rule(one: Array, other: Array) -> Bool:
        n, m = faces.take(one, axis=0), faces.take(other, axis=0)
        difference = n - m
        chord2 = np.einsum("ij,ij->i", difference, difference)
        chord2[~n.any(axis=1) | ~m.any(axis=1)] = CHORD2_OF_FLAT
        smooth: Bool = chord2 < largest
        return smooth

    return rule


def of_one_group(group: Int64) -> Rule:
    """Returns the rule that an edge is smooth if its triangles are in one smoothing group; group 0 is none.

    group: (T,) the group of each triangle.
    """

    def rule(one: Array, other: Array) -> Bool:
        smooth: Bool = (group[one] == group[other]) & (group[one] != 0)
        return smooth

    return rule


def split(mesh: Triangles, attributes: list[Array], own: int, rule: Callable[[Float64], Rule]) -> Split:
    """Returns the vertices that a mesh needs for smooth normals.

    mesh: the mesh, with the triangles of neighbouring parts behind its own.
    attributes: further arrays (V, n) of the vertices. Vertices that differ in their index alone become one vertex: an STL file
        has three separate ones for each triangle.
    own: the number of the mesh's own triangles. Only they are in the result.
    rule: a function that takes the normals (T, 3) of all triangles and returns the rule that decides which edges are smooth.

    Around a vertex, triangles share one normal if they are joined by smooth edges. The normal is the mean of the triangles'
    normals, weighted by their angles at the vertex (Thuermer and Wuethrich 1998). Vertices at equal positions are treated as
    one, so that the normals agree across seams of uvs and colours.
    """
    place = weld(mesh.positions)
    faces = face_normals(mesh)
    group, count = _fans(place.astype(np.int32).take(mesh.triangles), rule(faces))
    normals = smooth_by_label(mesh, group, count, faces)
    del faces
    group, triangles = group[: 3 * own], mesh.triangles[:own].reshape(-1)
    if attributes:  # the neighbours' vertices, which come last, have none
        place = weld(place[: len(attributes[0]), None], *attributes)
    corner_vertex = place[triangles]
    one = np.empty(count, dtype=np.int64)
    one[group] = corner_vertex
    if own == len(mesh.triangles) and np.array_equal(one[group], corner_vertex):
        label, labels = group, count
    else:
        label = weld((group << 32 | corner_vertex)[:, None])
        labels = int(label.max()) + 1
    source = np.empty(labels, dtype=np.int64)
    source[label[::-1]] = triangles[::-1]  # the last write wins, so writing backwards keeps the first
    which = np.empty(labels, dtype=np.int64)
    which[label] = group
    return Split(source, label, normals[which])


def _fans(places: Int32, rule: Rule) -> tuple[Int64, int]:
    """Groups the triangle corners that share a normal. Returns the group of each corner (3T,), from 0, and their number.

    places: (T, 3) the label of the position of each corner.
    rule: decides which edges are smooth.

    Two corners at one place are joined if their triangles share a smooth edge that starts there. A group is a connected
    component of joined corners.
    """
    tail = places.reshape(-1)
    head = places[:, [1, 2, 0]].reshape(-1)
    forth = tail < head
    one, other = [], []
    for e1, e2 in _pairs(tail, head):
        smooth = rule(e1 // 3, e2 // 3)
        e1, e2 = e1[smooth], e2[smooth]
        for end in (True, False):
            one.append(_corner_at(e1, forth[e1] == end))
            other.append(_corner_at(e2, forth[e2] == end))
    if not one:
        return np.arange(len(tail)), len(tail)
    del forth
    return _components(len(tail), np.concatenate(one), np.concatenate(other))


def _corner_at(edge: Int32, start: Bool) -> Int32:
    """Returns the corner (N,) at which an edge starts, where `start` (N,) is true, and otherwise that at which it ends.

    Edge i of all triangles starts at corner i. It ends at the next corner of the same triangle.
    """
    corner: Int32 = np.where(start, edge, np.where(edge % 3 == 2, edge - 2, edge + 1))
    return corner


def _pairs(tail: Int32, head: Int32) -> list[tuple[Int32, Int32]]:
    """Returns the pairs of edges that join the same two places, as a list of two arrays (N,) of edges, in blocks.

    tail, head: (3T,) the places at which the edges start and end. An edge without length has no partner.
    """
    key = np.minimum(tail, head).astype(np.int64)
    key <<= 32
    key |= np.maximum(tail, head)
    order = np.argsort(key, kind="stable").astype(np.int32)
    key = key[order]
    pairs = []
    for step in range(1, MOST_AT_AN_EDGE + 1):
        first = np.flatnonzero(key[step:] == key[:-step])
        if not len(first):
            break
        for block in blocks(len(first)):
            e1, e2 = order[first[block]], order[first[block] + step]
            long = tail[e1] != head[e1]
            pairs.append((e1[long], e2[long]))
    return pairs


def _components(count: int, one: Int32, other: Int32) -> tuple[Int64, int]:
    """Finds the connected components of the graph with nodes 0..count-1 and edges one[i]-other[i].

    Returns the label of each node's component (count,), from 0, and the number of components. Each round hooks the roots at
    the two ends of every edge together, the greater under the lesser, and then shortens all paths to their roots (Shiloach
    and Vishkin 1982). The fans of a mesh need a handful of rounds.
    """
    nodes = np.arange(count, dtype=np.int32)
    root = nodes.copy()
    while len(one):
        a, b = root[one], root[other]
        apart = a != b
        one, other, a, b = one[apart], other[apart], a[apart], b[apart]
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        shorter = root[root]
        moved = np.flatnonzero(shorter != root)
        root = shorter
        while len(moved):  # only a path that has just become shorter can become shorter still
            shorter = root[root[moved]]
            still = shorter != root[moved]
            root[moved] = shorter
            moved = moved[still]
    number = np.cumsum(root == nodes) - 1
    return number[root], int(number[-1]) + 1
