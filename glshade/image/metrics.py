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
# Larger values count as this one: the tone mapping of FLIP squares them, which must not overflow in float32.
BRIGHTEST = 1e10


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
        flip=float(np.mean(flip_map(true_colours, np.where(measured[..., None], colours, true_colours)))) if flip else 0.0,
        non_finite=int((~np.isfinite(picture)).sum()),
    )


def largest(several: list[Errors]) -> Errors:
    """Returns the largest value of each error, with the pixel of the largest max_abs."""
    worst = max(several, key=lambda e: e.max_abs)
    numbers = {name: max(getattr(e, name) for e in several) for name in (*METRICS, "non_finite")}
    return Errors(at=worst.at, **numbers)


def flip_map(truth: Array, picture: Array, brightest: float | None = None) -> Array:
    """Returns FLIP of each pixel, (H, W), for two linear pictures (H, W, 3).

    brightest: None compares them as a screen shows them, clipped to [0, 1] (Andersson et al. 2020). A number compares them at
        several exposures, so that values up to it can be told apart (Andersson et al. 2021); larger ones count as it.
    """
    import OpenImageIO as oiio

    high = 1.0 if brightest is None else min(brightest, BRIGHTEST)
    first, second = (oiio.ImageBuf(np.ascontiguousarray(np.clip(p, 0.0, high), dtype=np.float32)) for p in (truth, picture))
    hdr = int(brightest is not None)
    difference = oiio.ImageBufAlgo.FLIP_diff(first, second, hdr=hdr, maxluminance=high, ppd=PIXELS_PER_DEGREE)
    return np.asarray(difference.get_pixels(oiio.FLOAT))[..., 0]
