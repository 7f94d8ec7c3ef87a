"""Fans: finds which corners of triangles share a normal, and splits vertices that need several normals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from glshade.arrays import Array, Float64, Int64
from glshade.mesh.geometry import Triangles, blocks, normals_and_angles, smooth_by_label
from glshade.mesh.topology import Bool, Corners, Int32, Topology, topology_of
from glshade.mesh.welding import weld

# A rule takes two arrays of triangles (N,) that share an edge, and returns whether the surface is smooth across it (N,).
Rule: TypeAlias = Callable[[Array, Array], Bool]

# An edge counts as sharp if it bends by more than the threshold minus this [degrees]. A file with six digits turns a face that
# is a hundredth of the mesh in size by up to 0.006 degrees. The result for an edge at the threshold must not depend on that.
# For the same reason, an edge that bends by less than this is flat, and smooth at any threshold.
THRESHOLD_SLACK = 0.01
# A triangle without area has no normal. Its edges count as bent by 90 degrees, for which the square of the chord is this.
CHORD2_OF_FLAT = 2.0


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

    columns = [np.ascontiguousarray(column) for column in faces.T]  # NumPy is slow along an axis of three
    flat = (columns[0] == 0) & (columns[1] == 0) & (columns[2] == 0)
    any_flat = bool(flat.any())

    def rule(one: Array, other: Array) -> Bool:
        dx, dy, dz = (column.take(one) - column.take(other) for column in columns)
        chord2 = dx * dx + dy * dy + dz * dz
        if any_flat:
            chord2[flat[one] | flat[other]] = CHORD2_OF_FLAT
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
    faces, angles = normals_and_angles(mesh)
    corners = _corners(topology_of(mesh), attributes, own, rule(faces))
    normals = smooth_by_label(faces, angles, corners.group, corners.count)
    return Split(corners.source, corners.label, normals[corners.which])


def _corners(edges: Topology, attributes: list[Array], own: int, rule: Rule) -> Corners:
    """Returns the new vertices of a mesh: those of the last mesh with this topology, if the same edges are smooth.

    attributes, own: as for `split`.
    rule: decides which edges are smooth.
    """
    smooth = _smooth(edges.pairs, rule)
    # The neighbours' vertices, which come last, have no attributes.
    vertex = weld(edges.place[: len(attributes[0]), None], *attributes) if attributes else edges.place
    last = edges.corners
    if last and last.own == own and np.array_equal(last.smooth, smooth) and np.array_equal(last.vertex, vertex):
        return last
    group, count = _fans(edges, smooth)
    triangles = edges.triangles[:own].reshape(-1)
    corner_vertex, own_group = vertex[triangles], group[: 3 * own]
    one = np.empty(count, dtype=np.int64)
    one[own_group] = corner_vertex
    if own == len(edges.triangles) and np.array_equal(one[own_group], corner_vertex):
        label, labels = own_group, count
    else:
        label = weld((own_group << 32 | corner_vertex)[:, None])
        labels = int(label.max()) + 1
    source = np.empty(labels, dtype=np.int64)
    source[label[::-1]] = triangles[::-1]  # the last write wins, so writing backwards keeps the first
    which = np.empty(labels, dtype=np.int64)
    which[label] = own_group
    edges.corners = Corners(smooth, vertex, own, group, count, source, label, which)
    return edges.corners


def _smooth(pairs: tuple[Int32, Int32], rule: Rule) -> Bool:
    """Returns which pairs of edges are smooth (E,)."""
    smooth = np.empty(len(pairs[0]), dtype=np.bool_)
    for block in blocks(len(smooth)):
        e1, e2 = (edges[block] for edges in pairs)
        smooth[block] = rule(e1 // 3, e2 // 3)
    return smooth


def _fans(edges: Topology, smooth: Bool) -> tuple[Int64, int]:
    """Groups the triangle corners that share a normal. Returns the group of each corner (3T,), from 0, and their number.

    smooth: (E,) which of the pairs of edges are smooth.

    Two corners at one place are joined if their triangles share a smooth edge that starts there. A group is a connected
    component of joined corners.
    """
    tail, head = edges.places.reshape(-1), edges.places[:, [1, 2, 0]].reshape(-1)
    forth = tail < head
    one, other = [], []
    for block in blocks(len(smooth)):
        e1, e2 = (edge[block][smooth[block]] for edge in edges.pairs)
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
