"""Checking: checks and converts the arrays from which Mesh.build makes a mesh, and leaves out what cannot be drawn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glshade.arrays import Array, Float32, Float64, UInt32
from glshade.errors import AssetError

# Where at least this share of the triangles is wound against its normals, a file gets a warning. A few slivers, whose smooth
# normals are those of their neighbours, are no fault of a file.
MENTIONED = 0.01


@dataclass
class Faults:
    """Counts what was left out or replaced while meshes were built.

    triangles: the triangles that were given.
    not_finite: the triangles that were left out, because a corner is not finite.
    uvs: the vertices whose texture coordinates were replaced.
    colours: the vertices whose colour was replaced.
    with_normals: the triangles that were given with normals.
    against: those of them that are wound against their normals.
    visible: whether a triangle has an area; None where nobody has looked.
    """

    triangles: int = 0
    not_finite: int = 0
    uvs: int = 0
    colours: int = 0
    with_normals: int = 0
    against: int = 0
    visible: bool | None = None

    def lines(self) -> Iterator[str]:
        """Yields one line for each kind of fault."""
        if self.not_finite:
            yield (
                f"{self.not_finite:,} of {self.triangles:,} triangles are left out: a corner is not finite (NaN or infinite)"
            )
        if self.visible is False:
            yield f"none of its {self.triangles:,} triangles has an area, so they are not visible"
        if self.uvs:
            yield f"texture coordinates of {self.uvs:,} vertices are not finite; (0, 0) is used there"
        if self.colours:
            yield f"colours of {self.colours:,} vertices are not finite; white is used there"
        if self.against and self.against >= MENTIONED * self.with_normals:
            share = f"{100 * self.against / self.with_normals:.3g} %"
            yield (
                f"{self.against:,} of {self.with_normals:,} triangles ({share}) are wound against their normals; the front is "
                'the side of the normals with sides = "auto", and the side of the winding with "front" and "both"'
            )


@dataclass(frozen=True)
class Arrays:
    """The arrays of a mesh, checked. Every vertex belongs to a triangle, and the positions, uvs and colours are finite.

    positions: (V, 3) float32 or float64.
    triangles: (T, 3).
    normals: (V, 3) of any length, which may hold anything; None if the mesh has none. The same holds for the rest.
    uvs: (V, 2).
    colours: (V, 4).
    smoothing: (T,) integers, the smoothing group of each triangle.
    tangents: (V, 4), with directions of any length, which may hold anything.
    """

    positions: Array
    triangles: UInt32
    normals: Float64 | None
    uvs: Float32 | None
    colours: Float32 | None
    smoothing: Array | None
    tangents: Float64 | None


def checked(
    positions: npt.ArrayLike,
    triangles: npt.ArrayLike,
    normals: npt.ArrayLike | None = None,
    uvs: npt.ArrayLike | None = None,
    colours: npt.ArrayLike | None = None,
    *,
    smoothing: npt.ArrayLike | None = None,
    tangents: npt.ArrayLike | None = None,
    faults: Faults,
) -> Arrays | None:
    """Returns the arrays of a mesh, without the triangles that have a corner which is not finite, and without the vertices that
    no triangle uses; None if no triangle is left.

    The arguments are those of `Mesh.build`. faults: counts what is left out or replaced.
    Errors: AssetError for a mesh without triangles, an array of a wrong shape, or an index out of range.
    """
    p: Array = np.asarray(positions)
    p = matrix(p, 3, "positions") if p.dtype != np.float32 or p.ndim != 2 or p.shape[1] != 3 or not p.size else p
    t = indices(triangles, len(p))
    groups = None if smoothing is None else _groups(smoothing, len(t))
    faults.triangles += len(t)
    finite: Array = np.isfinite(p)
    if not finite.all():
        kept = np.logical_and.reduce(finite, axis=1)[t].all(axis=1)
        faults.not_finite += len(t) - int(kept.sum())
        t, groups = t[kept], None if groups is None else groups[kept]
        if not len(t):
            return None
    used = np.zeros(len(p), dtype=np.bool_)
    used[t.reshape(-1)] = True
    everything = bool(used.all())
    if not everything:
        t = (np.cumsum(used, dtype=np.int64) - 1).astype(np.uint32)[t]

    def of_used(array: npt.ArrayLike | None, columns: int, name: str) -> Float64 | None:
        if array is None:
            return None
        values = matrix(array, columns, name)
        if len(values) != len(p):
            raise AssetError(f"mesh has {len(p)} positions and {len(values)} {name}")
        return values if everything else values[used]

    flat, uv_faults = _finite(of_used(uvs, 2, "uvs"), 0.0)
    colour, colour_faults = _finite(of_used(colours, 4, "colours"), 1.0)
    faults.uvs += uv_faults
    faults.colours += colour_faults
    return Arrays(
        p if everything else p[used],
        t,
        of_used(normals, 3, "normals"),
        flat,
        colour,
        groups,
        of_used(tangents, 4, "tangents"),
    )


def _finite(values: Float64 | None, instead: float) -> tuple[Float32 | None, int]:
    """Returns the rows (V, n) as float32, with `instead` in all columns of a row that is not finite; and how many those are."""
    if values is None:
        return None, 0
    with np.errstate(over="ignore"):
        result = values.astype(np.float32)
    wrong = ~np.isfinite(result).all(axis=1)
    result[wrong] = instead
    return result, int(wrong.sum())


def _groups(smoothing: npt.ArrayLike, count: int) -> Array:
    """Returns the smoothing groups of `count` triangles. Errors: AssetError for another number, or for no integers."""
    groups = np.asarray(smoothing)
    if groups.shape != (count,) or groups.dtype.kind not in "iu":
        raise AssetError(f"mesh smoothing is {groups.dtype} of shape {groups.shape}, not integers of shape ({count},)")
    return groups


def matrix(array: npt.ArrayLike, columns: int, name: str) -> Float64:
    """Returns the array as float64 of shape (n, columns).

    Errors: AssetError, with the array's name, for an array without rows or of another shape.
    """
    result = np.asarray(array, dtype=np.float64)
    if result.size == 0:
        raise AssetError(f"mesh has no {name}")
    if result.ndim != 2 or result.shape[1] != columns:
        raise AssetError(f"mesh {name} have shape {result.shape}, not (n, {columns})")
    return result


def indices(array: npt.ArrayLike, count: int) -> UInt32:
    """Returns the triangles (T, 3) of a mesh with `count` vertices as uint32.

    Errors: AssetError for an array without triangles, of another shape or of no integer type, or for an index out of range.
    """
    result = np.asarray(array)
    if result.size == 0:
        raise AssetError("mesh has no triangles")
    if result.ndim != 2 or result.shape[1] != 3 or result.dtype.kind not in "iu":
        raise AssetError(f"mesh triangles are {result.dtype} of shape {result.shape}, not integers of shape (n, 3)")
    for index in (int(result.min()), int(result.max())):
        if not 0 <= index < count:
            raise AssetError(f"triangle index {index} is out of range: the mesh has {count} vertices")
    return result.astype(np.uint32, copy=False)


def nothing_finite(faults: Faults) -> str:
    """Returns the message of a mesh that has lost all its triangles."""
    return f"none of its {faults.triangles:,} triangles can be drawn: each has a corner that is not finite (NaN or infinite)"
