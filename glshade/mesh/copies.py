"""Copies: one mesh at many places, as one array of poses."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from glshade.arrays import Array, Float64
from glshade.errors import AssetError
from glshade.limits import MOST_INSTANCES
from glshade.mesh.mesh import Mesh

# Columns that span a smaller volume once they are made unit flatten the mesh, whatever their scale.
FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class Copies:
    """One mesh that an object draws once at each of N poses: `Object(mesh=Copies.build(mesh, poses))`.

    mesh: the mesh.
    poses: (N, 4, 4) float64, from the mesh's space to the object's space.
    """

    mesh: Mesh
    poses: Float64

    @classmethod
    def build(cls, mesh: Mesh, poses: Any) -> Copies:
        """Returns the copies of a mesh.

        poses: (N, 4, 4), affine matrices for column vectors.
        Errors: AssetError for anything but a Mesh and real matrices, and for a pose that is not finite, not affine or flattens
        the mesh.
        """
        if not isinstance(mesh, Mesh):
            raise AssetError(f"copies need a Mesh, such as Mesh.build returns, not {type(mesh).__name__}")
        try:
            given = np.asarray(poses)
        except ValueError:
            raise AssetError("poses have rows of several lengths; they must have the shape (N, 4, 4)") from None
        if given.dtype.kind not in "fiu":
            raise AssetError(f"poses must hold real numbers, not {given.dtype}")
        if given.ndim != 3 or given.shape[1:] != (4, 4) or not len(given):
            raise AssetError(f"poses have the shape {given.shape}; they must have (N, 4, 4) with at least one pose")
        if len(given) > MOST_INSTANCES:
            raise AssetError(f"poses draw {len(given):,} copies of a mesh; {MOST_INSTANCES:,} are allowed")
        array = np.array(given, dtype=np.float64)
        for fault, wrong in (
            ("holds a number that is not finite", ~np.isfinite(array).all(axis=(1, 2))),
            ("must have the last row [0, 0, 0, 1]", (array[:, 3] != (0, 0, 0, 1)).any(axis=1)),
            ("flattens the mesh", are_flat(array[:, :3, :3])),
        ):
            if wrong.any():
                raise AssetError(f"poses[{int(wrong.argmax())}] {fault}")
        array.flags.writeable = False
        return cls(mesh, array)

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the mesh and the poses, as 64 hex digits."""
        return hashlib.sha256(self.mesh.digest.encode() + self.poses.tobytes()).hexdigest()


def are_flat(linear: Array) -> Array:
    """Returns whether matrices (N, 3, 3) flatten space (N,), whatever their scale."""
    with np.errstate(all="ignore"):
        # The square of 1e-200 is 0, so columns are divided by their largest number before their lengths are computed.
        column = linear / np.abs(linear).max(axis=1, keepdims=True)
        volume = np.abs(np.linalg.det(column / np.linalg.norm(column, axis=1, keepdims=True)))
    # A column of zeros gives NaN.
    return np.asarray(~(volume >= FLAT))
