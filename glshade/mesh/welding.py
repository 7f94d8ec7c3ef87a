"""Welding: finds equal rows of arrays, and normalises vectors."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshade.arrays import Array, Float64, Int64, UInt64

# The number of vectors that are made unit at once. Their arrays fit into a processor's cache.
ROWS = 1 << 15


def normalised(v: Float64) -> tuple[Float64, Float64]:
    """Returns unit vectors (N, 3) along v (N, 3), and the lengths (N,) of v. Both are 0 where v is zero, infinite or NaN.

    The vectors are divided by their largest component first, because the square of 1e-200 is 0.
    """
    if len(v) <= ROWS:
        return _normalised(v)
    unit, length = np.empty(v.shape), np.empty(len(v))
    for first in range(0, len(v), ROWS):
        rows = slice(first, first + ROWS)
        unit[rows], length[rows] = _normalised(v[rows])
    return unit, length


def _normalised(v: Float64) -> tuple[Float64, Float64]:
    """Returns what `normalised` returns, at once."""
    x, y, z = np.abs(v[:, 0]), np.abs(v[:, 1]), np.abs(v[:, 2])  # NumPy is slow along an axis of three
    scale = np.maximum(np.maximum(x, y), z)
    good = (scale > 0) & np.isfinite(scale)
    if good.all():
        unit = v / scale[:, None]
    else:
        scale = np.where(good, scale, 1.0)
        unit = np.where(good[:, None], v, 0.0) / scale[:, None]
    length = np.sqrt(np.einsum("ij,ij->i", unit, unit))
    unit /= np.where(good, length, 1.0)[:, None]
    with np.errstate(over="ignore"):
        return unit, length * scale


def weld(*columns: Array) -> Int64:
    """Returns (V,): a label for each row. Two rows get the same label if they are exactly equal in all of the arrays (V, n).

    Labels are numbered from 0 in the order of their first use. -0 equals 0. Every row is written into a hash table and looked
    up again. A row that finds a different row there, because of a collision, goes into the next round, which uses another
    hash function. This takes a quarter of the time of a sort.
    """
    words = left = [word for array in columns for word in _words(array)]
    count = len(words[0])
    bits = max(2 * count - 1, 1).bit_length()
    # Half as wide an index takes half the memory, which is most of what this function needs.
    index: Any = np.int32 if count < 1 << 31 else np.int64
    table = np.empty(1 << bits, dtype=index)
    factor = 1
    alike: Array = np.arange(count, dtype=index)
    rows: Array = alike
    while len(rows):
        mixed = np.zeros(len(rows), dtype=np.uint64)
        for word in left:
            factor = (factor * 6364136223846793005 + 1442695040888963407) % 2**64  # Knuth's generator for MMIX
            mixed += word * np.uint64(factor | 1)
        mixed ^= mixed >> np.uint64(32)
        mixed *= np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: Fibonacci hashing
        mixed >>= np.uint64(64 - bits)
        slot = mixed.view(np.int64)
        table[slot] = rows
        found = table[slot]
        if len(rows) == count:
            alike = found
        else:
            alike[rows] = found
        different = words[0][found] != left[0]
        for word, own in zip(words[1:], left[1:], strict=True):
            different |= word[found] != own
        rows = rows[different]
        left = [word[rows] for word in words]
    kept = alike == np.arange(count, dtype=index)
    label: Int64 = (np.cumsum(kept) - 1)[alike]
    return label


def _words(array: Array) -> list[UInt64]:
    """Returns the rows of an array (V, n) as a few arrays (V,) of 64-bit words, which are equal where the rows are equal."""
    array = array + 0  # this turns -0 into 0
    if array.itemsize == 4:
        padded = np.zeros((len(array), (array.shape[1] + 1) // 2 * 2), dtype=array.dtype)
        padded[:, : array.shape[1]] = array
        array = padded
    return list(np.ascontiguousarray(np.ascontiguousarray(array).view(np.uint64).T))
