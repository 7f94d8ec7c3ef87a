"""Arithmetic: how the machine computes with floats: in float64, in float32, or with every operation rounded at random."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

_DOUBLE = np.dtype(np.float64)
# The distance between 1 and the next float32, and the smallest and the largest normal float32.
ULP, TINY, HUGE = 2.0**-23, 2.0**-126, float(np.finfo(np.float32).max)
# The largest error of an operation that is rounded to nearest [ulps].
NEAREST = 0.5


@dataclass(frozen=True)
class Arithmetic:
    """Floats of one type, whose operations are rounded as that type rounds.

    dtype: the type: float64 or float32.
    """

    dtype: np.dtype[Any] = _DOUBLE

    def rounded(self, values: Array, line: int, ulps: Array | float = NEAREST) -> Array:
        """Returns the result of an operation as this arithmetic gives it.

        values: the result as NumPy computed it in `dtype`, of any shape.
        line: the line of the GLSL text that the operation stands in.
        ulps: the largest error that the specification allows the operation [ulps of the result].
        """
        return values


FLOAT64 = Arithmetic()
FLOAT32 = Arithmetic(np.dtype(np.float32))


@dataclass(frozen=True)
class RandomRounding(Arithmetic):
    """float64 numbers in which each operation errs at random, by at most the error that a float32 driver may make.

    The spread of several runs then says how far a driver's result may be from the exact one. Random rounding goes back to the
    CESTAC method (Vignes 1993). Numbers below the smallest normal float32 may be flushed to zero, and numbers above the largest
    one are infinite.

    random: the source of the random numbers.
    lines: the lines of the text whose operations err; None for all.
    correct: whether every function errs by no more than an addition does, as if the driver rounded its exact result.
    scale: a factor of all errors.
    on_grid: whether results are float32 numbers, so that they can meet a pole exactly, as those of a driver can.
    """

    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))
    lines: Collection[int] | None = None
    correct: bool = False
    scale: float = 1.0
    on_grid: bool = False

    def rounded(self, values: Array, line: int, ulps: Array | float = NEAREST) -> Array:
        if self.lines is not None and line not in self.lines:
            return values
        # An ulp of a number is at most 2^-23 of the number.
        noise = self.random.random(values.shape)
        noise -= 0.5
        noise *= 2 * ULP * self.scale * (NEAREST if self.correct else ulps)
        noise *= values
        noise += values
        if self.on_grid:
            noise = noise.astype(np.float32).astype(np.float64)
        size = np.abs(noise)
        if size.size and size.max() > HUGE:
            noise = np.where(size > HUGE, np.copysign(np.inf, noise), noise)
        if size.size and size.min() < TINY:
            flushed = (size < TINY) & (self.random.random(values.shape) < 0.5)
            noise = np.where(flushed, 0.0, noise)
        return noise
