"""Winding: compares the order in which triangles list their corners with the normals that a mesh was given."""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.mesh.geometry import area_vectors, blocks
from glshade.mesh.mesh import Mesh

# mesh -> the mesh that `turned_over` made from it; None where that is the mesh itself, which must not keep itself alive.
_turned: WeakKeyDictionary[Mesh, Mesh | None] = WeakKeyDictionary()


def against_normals(mesh: Mesh) -> NDArray[np.bool_]:
    """Returns (T,): whether all three normals of a triangle point to the side from which its corners are clockwise."""
    against = np.zeros(len(mesh.triangles), dtype=np.bool_)
    if mesh.normals is None or not len(mesh.triangles):
        return against
    faces = area_vectors(mesh)
    for block in blocks(len(against)):
        corners, (x, y, z) = mesh.triangles[block].T, faces[block].T
        against[block] = True
        for corner in corners:
            nx, ny, nz = mesh.normals.take(corner, axis=0).T
            against[block] &= nx * x + ny * y + nz * z < 0
    return against


def turned_over(mesh: Mesh) -> Mesh:
    """Returns the mesh with two corners exchanged in each triangle that is wound against its normals.

    A mesh without normals or without such triangles is returned as it is. So is one that is closed and wound outward, unless
    most of its triangles are wound against their normals: a few are slivers with the normals of their neighbours.
    """
    if mesh.normals is None:
        return mesh
    if mesh not in _turned:
        against = against_normals(mesh)
        count = int(against.sum())
        kept = not count or (2 * count <= len(against) and mesh.is_solid)
        triangles = mesh.triangles.copy()
        triangles[against] = triangles[against][:, [0, 2, 1]]
        _turned[mesh] = None if kept else replace(mesh, triangles=triangles)
    return _turned[mesh] or mesh
