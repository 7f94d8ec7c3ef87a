"""Arrays: the types of NumPy arrays that several rooms use, and the one place where float64 is rounded to float32."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from numpy.typing import NDArray


def rounded(value: Any) -> NDArray[np.float32]:
    """float32; what is too large for it becomes infinite, and is refused by the renderer."""
    with np.errstate(over="ignore"):
        return np.asarray(value, dtype=np.float64).astype(_precision.get())


_precision: ContextVar[Any] = ContextVar("precision", default=np.float32)


@contextmanager
def unrounded() -> Iterator[None]:
    """Within it `rounded` leaves float64 as it is: for the reference alone, to see what rounding the inputs costs."""
    token = _precision.set(np.float64)
    try:
        yield
    finally:
        _precision.reset(token)
