"""Tangents: a tangent frame at every vertex, along the texture coordinates or round the y axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from glshade.arrays import Float64
from glshade.mesh.geometry import corner_angles, sum_by_label
from glshade.mesh.mesh import Mesh, gather
from glshade.mesh.welding import normalised, weld

# The tangents on the two sides of a uv seam are averaged if their sum is longer than this fraction of the sum of their lengths,
# which holds for an angle between them of up to 36 degrees.
AGREEING = 0.95
# Where |n x y| is smaller than this, cross(y, n) does not give a direction.
POLE = 1e-6


def with_tangents(mesh: Mesh) -> Mesh:
    """Returns the mesh with a tangent frame at every vertex.

    Mesh.tangents explains its parts t and w. Where the mesh has uvs, t is the mean of the position's derivative by u over the
    triangles around a vertex, weighted by angle, and w is the handedness of the uvs. A vertex between mirrored and unmirrored
    triangles is split. Where the mesh has no uvs, or they give no direction, t is that of `brushed` and w is +1.

    Errors: ValueError for a mesh without normals.
    """
    if mesh.normals is None:
        raise ValueError("with_tangents needs a mesh with normals: call with_normals first")
    if mesh.uvs is None:
        t = brushed(mesh.normals)
        return replace(mesh, tangents=np.column_stack([t, np.ones(len(t))]).astype(np.float32))

    corners = mesh.triangles.reshape(-1)
    p = mesh.positions.astype(np.float64)[mesh.triangles]
    uv = mesh.uvs.astype(np.float64)[mesh.triangles]
    (du1, dv1), (du2, dv2) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    area = du1 * dv2 - du2 * dv1
    # This is the derivative of the position p by u, times |area|. Only the direction matters, and without the division the
    # result is finite for every uv.
    along_u = np.sign(area)[:, None] * (dv2[:, None] * (p[:, 1] - p[:, 0]) - dv1[:, None] * (p[:, 2] - p[:, 0]))
    along_u = normalised(along_u)[0]

    mirrored = np.repeat(area < 0, 3)
    pairs, label = np.unique(corners.astype(np.int64) << 1 | mirrored, return_inverse=True)
    split = gather(mesh, pairs >> 1, label)
    assert split.normals is not None
    assert split.uvs is not None
    w = np.where(pairs & 1, -1.0, 1.0)
    # Tangents are summed over all vertices with equal attributes, so that a file without shared vertices gets the same ones.
    weighted = np.repeat(along_u, 3, axis=0) * corner_angles(mesh).reshape(-1, 1)
    alike = weld(split.positions, split.normals, split.uvs, w[:, None])
    total = sum_by_label(weighted, alike[label], int(alike.max()) + 1)[alike]
    # Tangents are also summed across a seam of the uvs, unless they differ there, as at the poles of a sphere.
    across = weld(split.positions, split.normals, w[:, None])
    joined = sum_by_label(weighted, across[label], int(across.max()) + 1)
    lengths = np.bincount(across[label], weights=np.linalg.norm(weighted, axis=1), minlength=len(joined))
    agree = (np.linalg.norm(joined, axis=1) > AGREEING * lengths)[across]
    total[agree] = joined[across[agree]]
    n = split.normals.astype(np.float64)
    total = normalised(total)[0]
    t = total - n * np.einsum("ij,ij->i", n, total)[:, None]
    t, length = normalised(t)
    # Below 1e-6 the direction of u is parallel to the normal, and its component across the normal consists of rounding errors.
    lost = length < 1e-6
    t[lost], w[lost] = brushed(split.normals[lost]), 1.0
    return replace(split, tangents=np.column_stack([t, w]).astype(np.float32))


def brushed(n: npt.ArrayLike) -> Float64:
    """Returns unit tangents (..., 3) for unit normals n (..., 3) of any leading shape: cross(y, n), made unit.

    They suit metal that was brushed round the y axis. Where n is within 1e-6 of +-y, cross(y, n) has no direction, and the
    tangent is the x axis made perpendicular to n.
    """
    n = np.asarray(n, dtype=np.float64)
    t = np.stack([n[..., 2], np.zeros_like(n[..., 0]), -n[..., 0]], axis=-1)
    pole = np.hypot(n[..., 0], n[..., 2]) < POLE
    t[pole] = np.array([1.0, 0.0, 0.0]) - n[pole] * n[pole][..., :1]
    return normalised(t)[0]
