"""Vectors: operations on arrays of vectors (..., 3), whose results keep the leading shape."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def dot(a: Array, b: Array) -> Array:
    """Returns the dot products (..., 1)."""
    return np.sum(a * b, axis=-1, keepdims=True)


def unit(a: Array) -> Array:
    """Returns the vectors made unit; a zero vector stays zero."""
    length = np.sqrt(dot(a, a))
    return np.divide(a, length, out=np.zeros_like(a), where=length > 0)


def across(a: Array, n: Array) -> Array:
    """Returns the parts of the vectors a that are perpendicular to the unit vectors n."""
    return a - n * dot(n, a)


def single(a: Any) -> Array:
    """Returns the numbers rounded to float32, as float64. Meshes hold such numbers."""
    return np.asarray(a, dtype=np.float64).astype(np.float32).astype(np.float64)
