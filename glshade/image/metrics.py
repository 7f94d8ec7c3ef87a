"""Metrics: numbers that say how far a picture is from the true one."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image.srgb import linear_to_srgb

Array = NDArray[Any]
# The default of FLIP's authors: a screen 0.7 m and 3840 pixels wide, seen from 0.7 m.
PIXELS_PER_DEGREE = 67.0


@dataclass(frozen=True)
class Errors:
    """The errors of one picture, or the largest ones of several pictures.

    The error of a pixel is the largest absolute difference of its three colour channels, in linear light. A pixel with an
    infinity or a NaN counts in `non_finite` alone.

    max_abs: the largest error.
    at: x, y of the pixel with the largest error.
    rmse: root of the mean squared error.
    p999: the error that 99.9 % of the pixels do not exceed, interpolated between pixels.
    codes: share of the channels whose 8-bit sRGB code differs, from 0 to 1.
    flip: the mean of FLIP over all pixels, from 0 to 1 (Andersson et al. 2020).
    non_finite: number of channel values that are infinite or NaN.
    """

    max_abs: float
    at: tuple[int, int]
    rmse: float
    p999: float
    codes: float
    flip: float
    non_finite: int

    def as_dict(self) -> dict[str, Any]:
        """Returns the errors by name, ready for JSON."""
        return asdict(self)


# The errors that a budget can limit.
METRICS = ("max_abs", "rmse", "p999", "codes", "flip")


def errors(picture: Array, truth: Array, where: NDArray[np.bool_] | None = None, flip: bool = True) -> Errors:
    """Returns the errors of a picture.

    picture, truth: (H, W, 3 or 4), linear Rec. 709; alpha is ignored.
    where: optional (H, W); only pixels where it is True are measured, except that `non_finite` counts in all pixels.
    flip: False skips FLIP, which is slow, and reports it as 0.
    """
    finite: Array = np.logical_and.reduce(np.isfinite(picture), axis=2)
    colours = np.where(finite[..., None], picture, truth)[..., :3].astype(np.float64)
    true_colours = truth[..., :3]
    measured = finite if where is None else finite & where
    error = np.where(measured, np.abs(colours - true_colours).max(axis=2), 0.0)
    y, x = np.unravel_index(int(np.argmax(error)), error.shape)
    measured_errors = error[measured] if measured.any() else np.zeros(1)
    codes, true_codes = (np.rint(np.clip(linear_to_srgb(c), 0, 1) * 255) for c in (colours, true_colours))
    different = (codes != true_codes)[measured]
    return Errors(
        max_abs=float(error.max(initial=0.0)),
        at=(int(x), int(y)),
        rmse=float(np.sqrt(np.mean(measured_errors**2))),
        p999=float(np.quantile(measured_errors, 0.999)),
        codes=float(different.mean()) if different.size else 0.0,
        flip=_flip(np.where(measured[..., None], colours, true_colours), true_colours) if flip else 0.0,
        non_finite=int((~np.isfinite(picture)).sum()),
    )


def largest(several: list[Errors]) -> Errors:
    """Returns the largest value of each error, with the pixel of the largest max_abs."""
    worst = max(several, key=lambda e: e.max_abs)
    numbers = {name: max(getattr(e, name) for e in several) for name in (*METRICS, "non_finite")}
    return Errors(at=worst.at, **numbers)


def _flip(picture: Array, truth: Array) -> float:
    """Returns the mean of FLIP for linear pictures (H, W, 3), which are clipped to [0, 1], the range of a screen."""
    import OpenImageIO as oiio

    clipped = [oiio.ImageBuf(np.ascontiguousarray(np.clip(p, 0, 1), dtype=np.float32)) for p in (truth, picture)]
    difference = oiio.ImageBufAlgo.FLIP_diff(clipped[0], clipped[1], hdr=0, ppd=PIXELS_PER_DEGREE)
    return float(np.mean(np.asarray(difference.get_pixels(oiio.FLOAT))))
