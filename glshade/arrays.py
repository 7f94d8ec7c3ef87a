"""Arrays: the types of NumPy arrays that several packages use, and the one place where float64 is rounded to float32."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import reduce
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]
UInt32: TypeAlias = NDArray[np.uint32]
UInt64: TypeAlias = NDArray[np.uint64]
Int64: TypeAlias = NDArray[np.int64]


def rounded(value: Any) -> NDArray[np.float32]:
    """Returns the value rounded to float32. Numbers too large for float32 become infinite; the renderer refuses them later."""
    with np.errstate(over="ignore"):
        return np.asarray(value, dtype=np.float64).astype(_precision.get())


_precision: ContextVar[Any] = ContextVar("precision", default=np.float32)


def precision() -> Any:
    """Returns the NumPy type of the arrays that `rounded` returns: float32, or float64 within `unrounded`."""
    return _precision.get()


@contextmanager
def unrounded() -> Iterator[None]:
    """Enters a context in which `rounded` keeps float64, to measure how much error the rounding of the inputs adds.

    It is for the reference renderer alone: the GPU takes no float64.
    """
    token = _precision.set(np.float64)
    try:
        yield
    finally:
        _precision.reset(token)


def group_starts(values: NDArray[Any]) -> NDArray[np.intp]:
    """Returns the indices at which a new value begins in a sorted array (N,); none for an empty array."""
    if not len(values):
        return np.empty(0, dtype=np.intp)
    return np.flatnonzero(np.append(True, values[1:] != values[:-1]))


def unit_and_length(x: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Returns the unit directions (..., K) and the lengths (...) of vectors (..., K). The zero vector has the direction 0.

    The vectors are scaled to a largest component of 1 first, so that their squares neither overflow nor underflow. NumPy takes
    maxima and sums of a few columns several times as fast as along an axis of a few numbers.
    """
    columns = [np.abs(x[..., k]) for k in range(x.shape[-1])]
    largest = reduce(np.maximum, columns)
    scaled = x / np.where(largest > 0, largest, 1)[..., None]
    length = np.sqrt(reduce(np.add, [scaled[..., k] ** 2 for k in range(x.shape[-1])]))
    return scaled / np.where(length > 0, length, 1)[..., None], length * largest
