"""Frames: tangents that are unit and perpendicular to the normals."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glshade.arrays import Float32, Float64
from glshade.mesh.welding import normalised

# Where |n x y| is smaller than this, cross(y, n) does not give a direction.
POLE = 1e-6
# Where the part of a unit direction across the normal is shorter than this, it consists of rounding errors.
PARALLEL = 1e-6


def framed(n: Float64, along: Float64, w: Float64) -> Float32:
    """Returns tangents (V, 4) as in Mesh.tangents: the given directions, made unit and perpendicular to the normals.

    A tangent whose direction is zero, infinite, NaN or parallel to the normal is that of `brushed`, with w = +1.

    n: (V, 3) unit normals.
    along: (V, 3) directions of any length.
    w: (V,) the handedness, +-1.
    """
    unit = normalised(along)[0]
    t, length = normalised(unit - n * np.einsum("ij,ij->i", n, unit)[:, None])
    lost = length < PARALLEL
    t[lost] = brushed(n[lost])
    return np.column_stack([t, np.where(lost, 1.0, w)]).astype(np.float32)


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
