"""Metrics: how far one picture is from another, in the ways that people ask for."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image.srgb import linear_to_srgb

Array = NDArray[Any]
# Of a 0.7 m wide screen of 3840 pixels seen from 0.7 m: the default of FLIP's authors.
PIXELS_PER_DEGREE = 67.0


@dataclass(frozen=True)
class Errors:
    """Of one picture, or the largest of several.

    max_abs: of linear light, at the pixel `at` (x, y). rmse, p999: of the pixels' largest channels. codes: share of 8-bit
    sRGB codes that are others. flip: mean of FLIP (Andersson et al. 2020). non_finite: values, left out of all the others.
    """

    max_abs: float
    at: tuple[int, int]
    rmse: float
    p999: float
    codes: float
    flip: float
    non_finite: int

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


# What a budget may be set for.
METRICS = ("max_abs", "rmse", "p999", "codes", "flip")


def errors(picture: Array, truth: Array, where: NDArray[np.bool_] | None = None, flip: bool = True) -> Errors:
    """picture, truth (H, W, 3 or 4): linear. where (H, W): the pixels that count. flip: left out it is 0."""
    finite: Array = np.logical_and.reduce(np.isfinite(picture), axis=2)
    one = np.where(finite[..., None], picture, truth)[..., :3].astype(np.float64)
    other = truth[..., :3]
    counted = finite if where is None else finite & where
    off = np.where(counted, np.abs(one - other).max(axis=2), 0.0)
    y, x = np.unravel_index(int(np.argmax(off)), off.shape)
    some = off[counted] if counted.any() else np.zeros(1)
    codes = [np.rint(np.clip(linear_to_srgb(p), 0, 1) * 255) for p in (one, other)]
    different = (codes[0] != codes[1])[counted]
    return Errors(
        max_abs=float(off.max(initial=0.0)),
        at=(int(x), int(y)),
        rmse=float(np.sqrt(np.mean(some**2))),
        p999=float(np.quantile(some, 0.999)),
        codes=float(different.mean()) if different.size else 0.0,
        flip=_flip(np.where(counted[..., None], one, other), other) if flip else 0.0,
        non_finite=int((~np.isfinite(picture)).sum()),
    )


def largest(several: list[Errors]) -> Errors:
    """The largest of each, and the pixel of the largest max_abs."""
    worst = max(several, key=lambda e: e.max_abs)
    numbers = {name: max(getattr(e, name) for e in several) for name in (*METRICS, "non_finite")}
    return Errors(at=worst.at, **numbers)


def _flip(picture: Array, truth: Array) -> float:
    """FLIP for screens: of what a screen can show, from linear light; by OpenImageIO."""
    import OpenImageIO as oiio

    shown = [oiio.ImageBuf(np.ascontiguousarray(np.clip(p, 0, 1), dtype=np.float32)) for p in (truth, picture)]
    difference = oiio.ImageBufAlgo.FLIP_diff(shown[0], shown[1], hdr=0, ppd=PIXELS_PER_DEGREE)
    return float(np.mean(np.asarray(difference.get_pixels(oiio.FLOAT))))
