"""Facets: makes a mesh for flat shading, which evaluates the BRDF once for each triangle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glshade.arrays import Float32, Float64
from glshade.mesh.frames import brushed
from glshade.mesh.geometry import blocks
from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.mesh.welding import normalised


def faceted(mesh: Mesh) -> Mesh:
    """Returns the mesh for flat shading: no two triangles share a vertex, and each vertex has the normal of its triangle.

    The BRDF is evaluated at the centroid of each triangle. Each corner therefore carries the centroid and the means of the
    triangle's uvs and colours in addition to its own uvs and colours, because alpha still varies over the triangle. Its
    tangent is the mean tangent of the triangle, made perpendicular to the normal.
    """
    split = with_normals(mesh, "face", 0.0)
    assert split.normals is not None

    def mean(array: Float32 | None) -> Float32 | None:
        """Returns the mean of each triangle's values, at each of its corners (3T, n)."""
        return None if array is None else np.repeat(_means(mesh, array).astype(np.float32), 3, axis=0)

    tangents = None
    if mesh.tangents is not None:
        n = split.normals[::3].astype(np.float64)
        mean_t = _means(mesh, mesh.tangents[:, :3])
        t, length = normalised(mean_t - n * np.einsum("ij,ij->i", n, mean_t)[:, None])
        w = mesh.tangents[mesh.triangles[:, 0], 3]
        lost = length < 1e-6
        t[lost], w[lost] = brushed(n[lost]), 1.0
        tangents = np.repeat(np.column_stack([t, w]).astype(np.float32), 3, axis=0)
    return replace(
        split,
        tangents=tangents,
        centroids=mean(mesh.positions),
        centroid_uvs=mean(mesh.uvs),
        centroid_colours=mean(mesh.colours),
    )


def _means(mesh: Mesh, values: Float32) -> Float64:
    """Returns the mean (T, n) of the values (V, n) at the three corners of each triangle."""
    result = np.empty((len(mesh.triangles), values.shape[1]))
    for block in blocks(len(result)):
        a, b, c = values.take(mesh.triangles[block].T, axis=0).astype(np.float64)
        result[block] = (a + b + c) / 3
    return result
