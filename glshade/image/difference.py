"""Difference: how two pictures of the same size differ, pixel by pixel."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError

Array = NDArray[Any]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Difference:
    """How two pictures of the same size differ.

    The error of a pixel is the largest absolute difference of its channels, in the unit of the pictures. It is 0 for masked
    pixels. A channel that is infinite or NaN in either picture adds nothing to it.

    non_finite: number of channel values, in all pixels, that are infinite or NaN in one of the pictures.
    worst: the largest error.
    rmse: root of the mean squared error.
    p999: the error that 99.9 % of the pixels do not exceed, interpolated between pixels.
    differing: number of pixels whose error exceeds the tolerance.
    map: (H, W) float64, the errors.
    """

    non_finite: int
    worst: float
    rmse: float
    p999: float
    differing: int
    map: Array = field(repr=False, compare=False)

    @property
    def same(self) -> bool:
        """True where all values are finite and no error exceeds the tolerance."""
        return self.non_finite == 0 and self.differing == 0


def compare(a: Any, b: Any, *, tolerance: float = 0.0, mask: Flags | None = None) -> Difference:
    """Compares two pictures of the same shape.

    a, b: each an Image or an array (H, W, C); usually linear, since their numbers are compared as they are.
    tolerance: the largest error at which a pixel still counts as the same.
    mask: optional (H, W); pixels where it is True are left out.
    Errors: GlshadeError where the shapes differ or are not (H, W, C).
    """
    first, second = (np.asarray(getattr(picture, "pixels", picture)) for picture in (a, b))
    if first.shape != second.shape or first.ndim != 3:
        raise GlshadeError(f"pictures of shapes {first.shape} and {second.shape} cannot be compared")
    finite = np.isfinite(first) & np.isfinite(second)
    error = np.abs(np.where(finite, first, 0).astype(np.float64) - np.where(finite, second, 0)).max(axis=2)
    if mask is not None:
        error = np.where(mask, 0.0, error)
    return Difference(
        non_finite=int((~finite).sum()),
        worst=float(error.max(initial=0.0)),
        rmse=float(np.sqrt(np.mean(error**2))) if error.size else 0.0,
        p999=float(np.quantile(error, 0.999)) if error.size else 0.0,
        differing=int((error > tolerance).sum()),
        map=error,
    )
