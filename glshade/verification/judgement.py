"""Judgement: compares a picture with the values that its pixels may have. This module does not depend on how either was made.

`classify` says how certain each pixel is, and `judge` compares a picture with the candidates of its pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError

Array = NDArray[Any]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]


class PixelClass(IntEnum):
    """A class says how certain the value of a pixel is, before any picture is drawn.

    BACKGROUND: no surface can cover the pixel. It has exactly the background's value.
    INTERIOR: one surface certainly covers the pixel and is certainly the nearest one.
    SEAM: triangles that share an edge certainly cover the pixel together. A driver may show either of them.
    SILHOUETTE: the pixel is at an outline. A driver may show one of several candidates or the background.
    TIE: several surfaces are at depths that a driver may be unable to tell apart.
    MASKED: the caller excluded the pixel by a mask.
    WIDE: float32 does not determine the pixel's value. A candidate's interval is so wide that it would explain a wrong value.
    EDGE: the pixel's samples may show several surfaces. Its value is a mixture, and lies in the hull of their values.
    """

    BACKGROUND = 0
    INTERIOR = 1
    SEAM = 2
    SILHOUETTE = 3
    TIE = 4
    MASKED = 5
    WIDE = 6
    EDGE = 7

    @property
    def ambiguous(self) -> bool:
        """Whether pixels of this class are ambiguous. A picture with too many ambiguous pixels cannot be verified."""
        return self in (PixelClass.SILHOUETTE, PixelClass.TIE, PixelClass.MASKED, PixelClass.WIDE)


@dataclass(frozen=True, eq=False)
class Expected:
    """The values that the pixels of a picture may have, as N candidates; a pixel may have several.

    size: width, height of the picture [pixels].
    background: (4,), the clear colour [linear, premultiplied].
    classes: (H * W,), the PixelClass of each pixel.
    open: (H * W,), True where the background is accepted as well.
    pixel: (N,), ascending, the pixel of each candidate.
    low, high: (N, 4), the interval of each candidate.
    centre: (N, 4), the reference's own value of each candidate, inside the interval.
    room: the distance from the background's value that still counts as the background.
    mixed: True if pixels have several samples, so that the interval of a seam or an edge is the hull of several values.
    """

    size: tuple[int, int]
    background: Array
    classes: NDArray[np.uint8]
    open: Flags
    pixel: Indices
    low: Array
    high: Array
    centre: Array
    room: float = 0.0
    mixed: bool = False


@dataclass(frozen=True, eq=False)
class Comparison:
    """The result of comparing a picture with its candidates.

    A candidate explains a pixel if the pixel's value lies within the candidate's interval. The pixel's tolerance is the
    distance from the centre of the nearest candidate to the end of its interval. Only interior pixels count in worst, rmse,
    p999 and tolerance, and seams if each pixel has one sample.

    counts: the number of pixels of each class.
    non_finite: the number of channel values that are infinite or NaN.
    unexplained: the number of pixels that no candidate explains.
    error: (H, W), the distance from the centre of the nearest candidate, in the channel where it is largest [linear].
    excess: (H, W), the distance from the nearest interval, in the channel where it is largest; 0 for explained pixels [linear].
    used: (H, W), the ratio of the error to the pixel's tolerance.
    candidate: (H * W,), the index of the nearest candidate; -1 is the background.
    worst: the largest error [linear].
    rmse: the root of the mean squared error [linear].
    p999: the error that 99.9 % of the pixels do not exceed [linear].
    tolerance: the largest tolerance of any pixel [linear].
    empty: True if every pixel of the picture shows the background.
    may_be_empty: True if the reference accepts a picture that shows only the background.
    """

    counts: dict[PixelClass, int]
    non_finite: int
    unexplained: int
    error: Array
    excess: Array
    used: Array
    candidate: Indices
    worst: float
    rmse: float
    p999: float
    tolerance: float
    empty: bool
    may_be_empty: bool

    @property
    def ambiguous(self) -> float:
        """The share of silhouettes, ties, masked and wide pixels among all pixels."""
        return self._ambiguous / max(sum(self.counts.values()), 1)

    @property
    def doubtful(self) -> float:
        """The share of silhouettes, ties, masked and wide pixels and edges among the pixels that are not background."""
        doubtful = self._ambiguous + self.counts[PixelClass.EDGE]
        return doubtful / max(sum(self.counts.values()) - self.counts[PixelClass.BACKGROUND], 1)

    @property
    def _ambiguous(self) -> int:
        return sum(number for kind, number in self.counts.items() if kind.ambiguous)


def classify(
    size: int, pixel: Indices, front: Array, back: Array, partial: Flags, sheet: Indices
) -> tuple[Flags, NDArray[np.uint8], Flags, Array]:
    """Returns (kept (N,), classes (size,), open (size,), hidden (size,)) for N opaque candidates.

    kept: True for a candidate that may be visible.
    classes: the PixelClass of each pixel.
    open: True for a pixel in which the background may be visible.
    hidden: the depth in each pixel behind which no candidate is visible.

    size: the number of pixels in the picture.
    pixel: (N,), the pixel of each candidate.
    front: (N,), the largest depth that a driver may find, from 1 at the near plane to 0 at the far plane.
    back: (N,), the smallest depth that a driver may find.
    partial: (N,), True for a candidate that a driver may leave out.
    sheet: (N,), the number of the sheet that a partial candidate belongs to; -1 if it belongs to none. The candidates of a
        sheet certainly cover their pixel together.
    """
    nearest = np.full(size, -np.inf)
    certain = ~partial
    np.maximum.at(nearest, pixel[certain], back[certain])
    sealed = sheet >= 0
    _, first, number = np.unique(sheet[sealed], return_index=True, return_inverse=True)
    together = np.full(len(first), np.inf)
    np.minimum.at(together, number.reshape(-1), back[sealed])
    hidden = nearest
    np.maximum.at(hidden, pixel[sealed][first], together)
    kept = front >= hidden[pixel]
    count = np.bincount(pixel[kept], minlength=size)
    full = np.zeros(size, dtype=np.bool_)
    full[pixel[kept & (certain | sealed)]] = True
    loose, whole = np.zeros(size, dtype=np.bool_), np.zeros(size, dtype=np.bool_)
    loose[pixel[kept & partial & ~sealed]] = True
    whole[pixel[kept & certain]] = True
    classes = np.full(size, PixelClass.TIE, dtype=np.uint8)
    classes[full & ~whole] = PixelClass.SEAM
    classes[(count == 1) & full] = PixelClass.INTERIOR
    classes[loose] = PixelClass.SILHOUETTE
    classes[count == 0] = PixelClass.BACKGROUND
    return kept, classes, loose & ~full, hidden


def judge(picture: Array, expected: Expected, mask: Flags | None = None) -> Comparison:
    """Compares a picture with the values that it may have.

    picture: (H, W, 3 or 4) [linear, premultiplied].
    mask: optional (H, W); True for pixels that are left out.
    Errors: GlshadeError if the shapes differ.
    """
    width, height = expected.size
    if picture.ndim != 3 or picture.shape[:2] != (height, width) or picture.shape[2] not in (3, 4):
        raise GlshadeError(f"the picture has shape {picture.shape}, not ({height}, {width}, 3 or 4)")
    channels = picture.shape[2]
    # Infinities and NaN are counted first, because later clamps and comparisons could hide them.
    finite = np.isfinite(picture)
    non_finite = int((~finite).sum())
    value = np.where(finite, picture, 0.0).astype(np.float64).reshape(-1, channels)
    broken = ~finite.all(axis=2).reshape(-1)
    classes = expected.classes.copy()
    if mask is not None:
        classes[np.asarray(mask, dtype=np.bool_).reshape(-1)] = PixelClass.MASKED
    background = np.asarray(expected.background, dtype=np.float32).astype(np.float64)[:channels]
    from_background = np.abs(value - background).max(axis=1)
    from_background[from_background <= expected.room] = 0.0

    actual = value[expected.pixel]
    low, high, centre = (part[:, :channels] for part in (expected.low, expected.high, expected.centre))
    outside = np.maximum(np.maximum(low - actual, actual - high), 0).max(axis=1)
    error = np.abs(actual - centre)
    background_allowed = expected.open.copy()
    background_allowed[expected.pixel[((low <= background) & (background <= high)).all(axis=1)]] = True
    # Intervals need not be symmetric. The tolerance is the distance from the centre to the end on the side of the actual value.
    room = np.where(actual >= centre, high - centre, centre - low)
    share = (error / np.maximum(room, 1e-300)).max(axis=1)
    # The nearest candidate of a pixel is the first in this order.
    order = np.lexsort((share, outside, expected.pixel))
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = expected.pixel[order[1:]] != expected.pixel[order[:-1]]
    best = order[first]
    place = expected.pixel[best]

    size = width * height
    candidate = np.full(size, -1, dtype=np.intp)
    excess, errors, used, allowed = from_background.copy(), from_background.copy(), np.zeros(size), np.zeros(size)
    bare = expected.open | (classes == PixelClass.BACKGROUND)
    excess[place] = np.where(bare[place], np.minimum(outside[best], from_background[place]), outside[best])
    by_surface = ~(bare[place] & (from_background[place] == 0))
    chosen = best[by_surface]
    place = place[by_surface]
    candidate[place] = chosen
    errors[place] = error[chosen].max(axis=1)
    used[place] = share[chosen]
    allowed[place] = room[chosen].max(axis=1)
    excess[broken] = errors[broken] = np.inf
    excess[classes == PixelClass.MASKED] = 0.0
    counted = ((classes == PixelClass.INTERIOR) | ((classes == PixelClass.SEAM) & (not expected.mixed))) & ~broken
    interior = errors[counted]
    number = np.bincount(classes, minlength=len(PixelClass))
    return Comparison(
        counts={kind: int(number[kind]) for kind in PixelClass},
        non_finite=non_finite,
        unexplained=int((excess > 0).sum()),
        error=errors.reshape(height, width),
        excess=excess.reshape(height, width),
        used=used.reshape(height, width),
        candidate=candidate,
        worst=float(interior.max(initial=0.0)),
        rmse=float(np.sqrt(np.mean(interior**2))) if len(interior) else 0.0,
        p999=float(np.quantile(interior, 0.999)) if len(interior) else 0.0,
        tolerance=float(allowed[counted].max(initial=0.0)),
        empty=bool((from_background == 0).all()) and not broken.any(),
        may_be_empty=bool(background_allowed[expected.pixel].all()),
    )
