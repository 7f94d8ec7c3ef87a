"""Normals: gives vertices the normals of faces, or normals that are smooth across edges up to a threshold angle."""

from __future__ import annotations

from typing import Literal

import numpy as np

from glshade.mesh.fans import bent_less, split
from glshade.mesh.geometry import FALLBACK_NORMAL, area_vectors
from glshade.mesh.mesh import Mesh, gather
from glshade.mesh.welding import normalised


def with_normals(mesh: Mesh, kind: Literal["auto", "face", "smooth"], threshold: float) -> Mesh:
    """Returns the mesh with a normal at every vertex. A vertex that needs several normals is split into several vertices.

    kind "face": no two triangles share a vertex, and each vertex has the normal of its triangle (slide 56).
    kind "smooth": around a vertex, triangles share one normal if they are joined by edges that bend by less than `threshold`.
        That is the mean of the triangles' normals, weighted by their angles at the vertex (Thuermer and Wuethrich 1998; slides
        57-59). Vertices at equal positions are treated as one, so that the normals agree across seams of uvs and colours. A
        triangle without area has no normal, and its edges count as bent by 90 degrees. The triangles of `Mesh.neighbours` count
        as if they belonged to the mesh.
    kind "auto": the mesh is returned unchanged if it has normals, and is otherwise smoothed as by "smooth".
    threshold: the least angle between the normals of two faces at which the edge between them is sharp [degrees]. At 180 no
        edge is sharp.

    New normals drop the vertices that no triangle uses, the neighbours, and the tangents, which belong to the old normals.
    """
    if kind == "auto" and mesh.normals is not None:
        return mesh
    if kind == "face":
        n, length = normalised(area_vectors(mesh))
        n[length == 0] = FALLBACK_NORMAL
        corners = mesh.triangles.reshape(-1)
        return gather(mesh, corners, np.arange(len(corners)), normals=np.repeat(n.astype(np.float32), 3, axis=0))
    attributes = [a for a in (mesh.uvs, mesh.colours) if a is not None]
    made = split(mesh.with_neighbours(), attributes, len(mesh.triangles), lambda faces: bent_less(faces, threshold))
    return gather(mesh, made.source, made.corners, normals=made.normals)
