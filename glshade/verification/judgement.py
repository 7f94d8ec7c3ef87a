"""Comparison: a picture judged against what it may show. Who made the one or the other is not known here.

finite gate, classes of pixels, intervals, metrics -> Comparison; report.py writes it down.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError

Array = NDArray[Any]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]


class PixelClass(IntEnum):
    """What can be said of a pixel beforehand."""

    BACKGROUND = 0
    INTERIOR = 1
    SEAM = 2
    SILHOUETTE = 3
    TIE = 4
    MASKED = 5

    @property
    def ambiguous(self) -> bool:
        """Whether such pixels count against the budget."""
        return self >= PixelClass.SILHOUETTE


@dataclass(frozen=True, eq=False)
class Expected:
    """What a picture may show.

    size: width, height. background (4,). classes (H*W,): a PixelClass each. open (H*W,): where the background is accepted.
    pixel (N,), ascending: of each candidate; low, high, centre (N, 4): its interval, and the value in its middle.
    """

    size: tuple[int, int]
    background: Array
    classes: NDArray[np.uint8]
    open: Flags
    pixel: Indices
    low: Array
    high: Array
    centre: Array


@dataclass(frozen=True, eq=False)
class Comparison:
    """What came of it.

    counts: pixels of each class. non_finite: values. error (H, W): distance from the nearest accepted candidate's middle,
    the largest channel's. excess (H, W): how far outside every interval; 0 where a pixel is explained. used (H, W): the
    error's share of what is allowed. candidate (H*W,): the nearest one, -1: the background. worst, rmse, p999: of the errors
    of interior pixels and seams. tolerance: the largest allowed at any of them. empty: whether the picture is the background
    alone; may_be_empty: whether it may be.
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
        """The picture's share of silhouettes, ties and masked pixels."""
        return self._ambiguous / max(sum(self.counts.values()), 1)

    @property
    def doubtful(self) -> float:
        """The share of the same among all pixels that are not background."""
        return self._ambiguous / max(sum(self.counts.values()) - self.counts[PixelClass.BACKGROUND], 1)

    @property
    def _ambiguous(self) -> int:
        return sum(number for kind, number in self.counts.items() if kind.ambiguous)


def classify(
    size: int, pixel: Indices, depth: Array, slack: Array, partial: Flags, sealed: Flags
) -> tuple[Flags, NDArray[np.uint8], Flags, Array]:
    """(kept (N,), classes (size,), open (size,), hidden (size,)) of opaque candidates (N,) for the pixels of a picture.

    depth: 1 near, 0 far, known to `slack`. partial: may be covered or not. sealed: partial, but together with others certain
    to be covered. kept: what may be seen. hidden: a candidate farther than this cannot be seen.
    """
    nearest = np.full(size, -np.inf)
    certain = ~partial
    np.maximum.at(nearest, pixel[certain], (depth - slack)[certain])
    together = np.full(size, np.inf)
    np.minimum.at(together, pixel[sealed], (depth - slack)[sealed])
    together[np.isinf(together)] = -np.inf
    hidden = np.maximum(nearest, together)
    kept = depth + slack >= hidden[pixel]
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
    """Judges a linear picture (H, W, 3 or 4). mask (H, W): pixels to leave out.

    Errors: GlshadeError where the shapes differ.
    """
    width, height = expected.size
    if picture.ndim != 3 or picture.shape[:2] != (height, width) or picture.shape[2] not in (3, 4):
        raise GlshadeError(f"the picture has shape {picture.shape}, not ({height}, {width}, 3 or 4)")
    channels = picture.shape[2]
    # Before anything else: a clamp or a comparison would make something harmless of them.
    finite = np.isfinite(picture)
    non_finite = int((~finite).sum())
    value = np.where(finite, picture, 0.0).astype(np.float64).reshape(-1, channels)
    broken = ~finite.all(axis=2).reshape(-1)
    classes = expected.classes.copy()
    if mask is not None:
        classes[np.asarray(mask, dtype=np.bool_).reshape(-1)] = PixelClass.MASKED
    background = np.asarray(expected.background, dtype=np.float32).astype(np.float64)[:channels]
    from_background = np.abs(value - background).max(axis=1)

    of = value[expected.pixel]
    low, high, centre = (part[:, :channels] for part in (expected.low, expected.high, expected.centre))
    outside = np.maximum(np.maximum(low - of, of - high), 0).max(axis=1)
    error = np.abs(of - centre)
    unseen = expected.open.copy()
    unseen[expected.pixel[((low <= background) & (background <= high)).all(axis=1)]] = True
    # Of what is allowed on the side where the value lies.
    room = np.where(of >= centre, high - centre, centre - low)
    share = (error / np.maximum(room, 1e-300)).max(axis=1)
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
    there = place[by_surface]
    candidate[there] = chosen
    errors[there] = error[chosen].max(axis=1)
    used[there] = share[chosen]
    allowed[there] = room[chosen].max(axis=1)
    excess[broken] = errors[broken] = np.inf
    excess[classes == PixelClass.MASKED] = 0.0
    counted = ((classes == PixelClass.INTERIOR) | (classes == PixelClass.SEAM)) & ~broken
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
        may_be_empty=bool(unseen[expected.pixel].all()),
    )


@dataclass(frozen=True)
class Difference:
    """How two pictures differ. non_finite: values of either. worst, rmse, p999: of the pixels' largest channels."""

    non_finite: int
    worst: float
    rmse: float
    p999: float
    differing: int
    map: Array = field(repr=False, compare=False)

    @property
    def same(self) -> bool:
        """Whether nothing differs by more than was allowed, and everything is finite."""
        return self.non_finite == 0 and self.differing == 0


def compare(a: Any, b: Any, *, tolerance: float = 0.0, mask: Flags | None = None) -> Difference:
    """Two pictures of one size, (H, W, C) or Image, linear. tolerance: what a channel may differ by.

    mask (H, W): pixels to leave out. Errors: GlshadeError where the shapes differ.
    """
    one, other = (np.asarray(getattr(x, "pixels", x)) for x in (a, b))
    if one.shape != other.shape or one.ndim != 3:
        raise GlshadeError(f"pictures of shapes {one.shape} and {other.shape} cannot be compared")
    finite = np.isfinite(one) & np.isfinite(other)
    error = np.abs(np.where(finite, one, 0).astype(np.float64) - np.where(finite, other, 0)).max(axis=2)
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
