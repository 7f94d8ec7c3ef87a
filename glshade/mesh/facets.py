"""Facets: makes a mesh for flat shading, which evaluates the BRDF once for each triangle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glshade.arrays import Float32, Float64
from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.mesh.tangents import brushed
from glshade.mesh.welding import normalised


def faceted(mesh: Mesh) -> Mesh:
    """Returns the mesh for flat shading: no two triangles share a vertex, and each vertex has the normal of its triangle.

    The BRDF is evaluated at the centroid of each triangle. Each corner therefore carries the centroid and the means of the
    triangle's uvs and colours in addition to its own uvs and colours, because alpha still varies over the triangle. Its
    tangent is the mean tangent of the triangle, made perpendicular to the normal.
    """
    split = with_normals(mesh, "face", 0.0)
    assert split.normals is not None

    def mean(array: Float32 | None) -> Float64 | None:
        if array is None:
            return None
        return np.repeat(array.astype(np.float64)[mesh.triangles].mean(axis=1), 3, axis=0)

    def single(array: Float64 | None) -> Float32 | None:
        return None if array is None else array.astype(np.float32)

    tangents = None
    if mesh.tangents is not None:
        n = split.normals.astype(np.float64)
        mean_t = mean(mesh.tangents[:, :3])
        assert mean_t is not None
        t, length = normalised(mean_t - n * np.einsum("ij,ij->i", n, mean_t)[:, None])
        w = np.repeat(mesh.tangents[mesh.triangles[:, 0], 3], 3)
        lost = length < 1e-6
        t[lost], w[lost] = brushed(n[lost]), 1.0
        tangents = np.column_stack([t, w]).astype(np.float32)
    return replace(
        split,
        tangents=tangents,
        centroids=single(mean(mesh.positions)),
        centroid_uvs=single(mean(mesh.uvs)),
        centroid_colours=single(mean(mesh.colours)),
    )
