"""Checking: checks and converts the arrays from which Mesh.build makes a mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glshade.arrays import Float64, UInt32
from glshade.errors import AssetError


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
    return result.astype(np.uint32)


def row(values: Float64) -> str:
    """Returns the numbers of one row (n,) with spaces between them, for messages."""
    return " ".join(f"{x:g}" for x in values)
