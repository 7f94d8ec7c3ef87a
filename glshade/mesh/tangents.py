"""Tangents: a tangent frame at every vertex, along the texture coordinates or round the y axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Float64
from glshade.mesh.frames import brushed, framed
from glshade.mesh.geometry import by_corner, corner_angles, sum_by_label
from glshade.mesh.mesh import Mesh, gather
from glshade.mesh.welding import normalised, weld

# The tangents on the two sides of a uv seam are averaged if their sum is longer than this fraction of the sum of their lengths,
# which holds for an angle between them of up to 36 degrees.
AGREEING = 0.95


# The rows of the linear part of the matrix from a mesh's texture coordinates to those of the picture that tangents follow.
Axes = tuple[tuple[float, float], tuple[float, float]]
OWN_AXES: Axes = ((1.0, 0.0), (0.0, 1.0))


def with_tangents(mesh: Mesh, axes: Axes = OWN_AXES) -> Mesh:
    """Returns the mesh with a tangent frame at every vertex; the mesh itself if it has tangents.

    Mesh.tangents explains its parts t and w. Where the mesh has uvs, t is the mean of the position's derivative by u over the
    triangles around a vertex, weighted by angle, and w is the handedness of the uvs. A vertex between mirrored and unmirrored
    triangles is split. Where the mesh has no uvs, or they give no direction, t is that of `brushed` and w is +1.

    axes: optional; by default u and v are the mesh's own, otherwise those of a picture that is turned on the mesh.
    Errors: ValueError for a mesh without normals.
    """
    if mesh.normals is None:
        raise ValueError("with_tangents needs a mesh with normals: call with_normals first")
    if mesh.tangents is not None:
        return mesh
    if mesh.uvs is None:
        t = brushed(mesh.normals)
        return replace(mesh, tangents=np.column_stack([t, np.ones(len(t))]).astype(np.float32))

    weighted, mirrored = _along_u(mesh, mesh.uvs.astype(np.float64) @ np.array(axes).T)
    # A vertex is split in two if some of its triangles are mirrored and others are not.
    pair = mesh.triangles.reshape(-1).astype(np.int64) << 1 | np.repeat(mirrored, 3)
    occurs = np.zeros(2 * len(mesh.positions), dtype=np.bool_)
    occurs[pair] = True
    pairs, label = np.flatnonzero(occurs), (np.cumsum(occurs) - 1)[pair]
    split = gather(mesh, pairs >> 1, label)
    assert split.normals is not None
    assert split.uvs is not None
    w = np.where(pairs & 1, -1.0, 1.0)
    # Tangents are summed over all vertices with equal attributes, so that a file without shared vertices gets the same ones.
    alike = weld(split.positions, split.normals, split.uvs, w[:, None])
    total = sum_by_label(weighted, alike[label], int(alike.max()) + 1)[alike]
    # Tangents are also summed across a seam of the uvs, unless they differ there, as at the poles of a sphere.
    across = weld(split.positions, split.normals, w[:, None])
    joined = sum_by_label(weighted, across[label], int(across.max()) + 1)
    lengths = np.bincount(across[label], weights=np.linalg.norm(weighted, axis=1), minlength=len(joined))
    agree = (np.linalg.norm(joined, axis=1) > AGREEING * lengths)[across]
    total[agree] = joined[across[agree]]
    return replace(split, tangents=framed(split.normals.astype(np.float64), total, w))


def _along_u(mesh: Mesh, uvs: Float64) -> tuple[Float64, NDArray[np.bool_]]:
    """Returns the direction (3T, 3) in which u grows on the triangle of each corner, and whether the uvs of each triangle (T,)
    are mirrored. The length of a direction is the angle of its corner [rad].

    uvs: (V, 2).
    """
    angles = corner_angles(mesh)
    result, mirrored = np.empty((len(angles), 3, 3)), np.empty(len(angles), dtype=np.bool_)
    for block, ((px, py, pz), (qx, qy, qz), (rx, ry, rz)) in by_corner(mesh):
        a, b, c = uvs.take(mesh.triangles[block].T, axis=0)
        (du1, dv1), (du2, dv2) = (b - a).T, (c - a).T
        area = du1 * dv2 - du2 * dv1
        # This is the derivative of the position p by u, times |area|. Only the direction matters, and without the division the
        # result is finite for every uv.
        along = [dv2 * (q - p) - dv1 * (r - p) for p, q, r in ((px, qx, rx), (py, qy, ry), (pz, qz, rz))]
        unit = normalised(np.sign(area)[:, None] * np.stack(along, axis=1))[0]
        result[block] = unit[:, None] * angles[block, :, None]
        mirrored[block] = area < 0
    return result.reshape(-1, 3), mirrored
