"""Normals: gives vertices the normals of faces, or normals that are smooth across edges up to a threshold angle."""

from __future__ import annotations

from typing import Literal

import numpy as np

from glshade.arrays import Int64
from glshade.mesh.geometry import FALLBACK_NORMAL, area_vectors, face_normals, smooth_by_label
from glshade.mesh.mesh import Mesh, gather
from glshade.mesh.welding import normalised, weld

# This is added to a threshold [degrees]. Rounding to float32 positions turns a face by about 1e-5 degrees, and the result for
# the edges of a cube at a threshold of 90 must not depend on that.
THRESHOLD_SLACK = 1e-4


def with_normals(mesh: Mesh, kind: Literal["auto", "face", "smooth"], threshold: float) -> Mesh:
    """Returns the mesh with a normal at every vertex. A vertex that needs several normals is split into several vertices.

    kind "face": no two triangles share a vertex, and each vertex has the normal of its triangle (slide 56).
    kind "smooth": around a vertex, triangles share one normal if they are joined by edges that bend by at most `threshold`.
        That is the mean of the triangles' normals, weighted by their angles at the vertex (Thuermer and Wuethrich 1998; slides
        57-59). Vertices at equal positions are treated as one, so that the normals agree across seams of uvs and colours. A
        triangle without area has no normal, and its edges count as bent by 90 degrees.
    kind "auto": the mesh is returned unchanged if it has normals, and is otherwise smoothed as by "smooth".
    threshold: the largest angle between the normals of two faces at which the edge between them is smoothed [degrees].

    New normals drop the vertices that no triangle uses, and the tangents, which belong to the old normals.
    """
    if kind == "auto" and mesh.normals is not None:
        return mesh
    if kind == "face":
        n, length = normalised(area_vectors(mesh))
        n[length == 0] = FALLBACK_NORMAL
        corners = mesh.triangles.reshape(-1)
        return gather(mesh, corners, np.arange(len(corners)), normals=np.repeat(n, 3, axis=0))

    place = weld(mesh.positions)
    group, count = _fans(mesh, place, threshold)
    normals = smooth_by_label(mesh, group, count)

    # Vertices that differ only in their index become one vertex: an STL file has three separate ones for each triangle.
    attributes = [a for a in (mesh.uvs, mesh.colours) if a is not None]
    vertex = weld(place[:, None], *attributes) if attributes else place
    corner_vertex = vertex[mesh.triangles.reshape(-1)]
    one = np.empty(count, dtype=np.int64)
    one[group] = corner_vertex
    if np.array_equal(one[group], corner_vertex):
        label, labels = group, count
    else:
        _, label = np.unique(group << 32 | corner_vertex, return_inverse=True)
        labels = int(label.max()) + 1
    source = np.empty(labels, dtype=np.int64)
    source[label[::-1]] = mesh.triangles.reshape(-1)[::-1]  # the last write wins, so writing backwards keeps the first
    which = np.empty(labels, dtype=np.int64)
    which[label] = group
    return gather(mesh, source, label, normals=normals[which])


def _fans(mesh: Mesh, place: Int64, threshold: float) -> tuple[Int64, int]:
    """Groups the triangle corners that share a normal. Returns the group of each corner (3T,), from 0, and their number.

    place: (V,) the label of each vertex's position.
    threshold: see `with_normals` [degrees].

    Two corners at one place are joined if their triangles share an edge that starts there and bends by at most the threshold.
    A group is a connected component of joined corners.
    """
    corners = place[mesh.triangles]
    count = corners.size
    tail, head = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
    forth = tail < head
    key = np.where(forth, tail << 32 | head, head << 32 | tail)
    # For each edge of each triangle, the triangle's corners at the end with the lesser and with the greater place.
    here = np.arange(count)
    there = np.roll(here.reshape(-1, 3), -1, axis=1).reshape(-1)
    lesser, greater = np.where(forth, here, there), np.where(forth, there, here)
    order = np.argsort(key, kind="stable")
    order = order[tail[order] != head[order]]  # an edge without length joins nothing
    key = key[order]
    n = face_normals(mesh)
    flat = np.einsum("ij,ij->i", n, n) == 0
    # Angles are compared by the chord between unit normals, |n1 - n2| = 2 sin(angle / 2). Unlike the cosine, the chord is exact
    # for small angles.
    angle = np.radians(min(threshold + THRESHOLD_SLACK, 180.0))
    chord2 = 4 * np.sin(angle / 2) ** 2 if angle < np.pi else np.inf
    one, other = [], []
    # Neighbours in the sorted list share an edge. Where more than two triangles share an edge, entries that lie farther
    # apart share it too. The loop ends at eight: such a mesh is broken, and comparing all pairs would take quadratic time.
    for step in range(1, 9):
        same = np.flatnonzero(key[step:] == key[:-step])
        if len(same) == 0:
            break
        e1, e2 = order[same], order[same + step]
        t1, t2 = e1 // 3, e2 // 3
        difference = n.take(t1, axis=0) - n.take(t2, axis=0)
        bend = np.einsum("ij,ij->i", difference, difference)
        bend[flat[t1] | flat[t2]] = 2.0
        smooth = bend <= chord2
        e1, e2 = e1[smooth], e2[smooth]
        one += [lesser[e1], greater[e1]]
        other += [lesser[e2], greater[e2]]
    return _components(count, np.concatenate(one), np.concatenate(other)) if one else (here, count)


def _components(count: int, one: Int64, other: Int64) -> tuple[Int64, int]:
    """Finds the connected components of the graph with nodes 0..count-1 and edges one[i]-other[i].

    Returns the label of each node's component (count,), from 0, and the number of components. Each round hooks the roots at
    the two ends of every edge together, the greater under the lesser, and then shortens all paths to their roots (Shiloach
    and Vishkin 1982). The fans of a mesh need a handful of rounds.
    """
    root = np.arange(count)
    while len(one):
        a, b = root[one], root[other]
        apart = a != b
        one, other, a, b = one[apart], other[apart], a[apart], b[apart]
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while True:
            shorter = root[root]
            if np.array_equal(shorter, root):
                break
            root = shorter
    is_root = root == np.arange(count)
    number = np.cumsum(is_root) - 1
    return number[root], int(number[-1]) + 1
