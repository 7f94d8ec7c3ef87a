"""Fitting: what the sources of faults know of a wrong picture, and the faults that they yield."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.change import Change
from glshade.golden.result import Stage
from glshade.golden.surfaces import Surfaces

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# If a fault leaves less than this, there is no need to look for a second one beside it.
COMPLETE = 0.9995
# The number of objects, those with the largest change, for which faults of one object are tried; and the share of all change
# above which an object's change is considerable.
OBJECTS, SMALL = 8, 0.001
# The least and the usual number of pixels by which the numbers of a fault are found.
FEWEST, FITTED = 8, 300
# An 8-bit value of at least this much may stand for any brighter value [share of white].
CLIPPED = 0.998


@dataclass(frozen=True, eq=False)
class SceneFault:
    """A fault of some objects, and the light that it would give.

    kind, stage: as in `Cause`.
    text: the fault in words, for str.format. {objects} stands where the names of its objects belong, and {of} where " of" and
        these names belong if the fault is not one of the whole scene.
    light: (K, 3), what the pixels would show [linear].
    alone: whether the fault can be one object's; otherwise it is one of the whole scene.
    whole: whether the fault can be that of all objects alike; otherwise the fault is `only`'s.
    only: the index of the only draw that has the fault; -1 for any.
    """

    kind: str
    text: str
    stage: Stage
    light: Array
    alone: bool = True
    whole: bool = True
    only: int = -1


def literal(name: str) -> str:
    """Returns a name for the text of a fault, in which braces have a meaning."""
    return name.replace("{", "{{").replace("}", "}}")


@dataclass(frozen=True, eq=False)
class Fitting:
    """What the sources of faults need to know.

    change: the change, with a sample of K pixels.
    surfaces: the surfaces at these pixels.
    counts: (K,), the pixels that are certain to show the surface, and no blended one over it.
    objects: the indices of the draws with the largest changes, the largest first.
    explained: those of them whose change a fault explains already.
    """

    change: Change
    surfaces: Surfaces
    counts: Flags
    objects: tuple[int, ...]
    explained: frozenset[int] = frozenset()

    @property
    def target(self) -> Array:
        """(K, 3), the light of the wrong picture [linear]."""
        return self.change.linear(self.change.found[:, :3])

    def subset(self, which: NDArray[np.intp]) -> Fitting:
        """Returns the fitting for some of the pixels, given by their positions (N,), ascending."""
        change = replace(self.change, pixel=self.change.pixel[which], weight=self.change.weight[which])
        return Fitting(change, self.surfaces.subset(which), self.counts[which], self.objects, self.explained)

    def of(self, draw: int) -> Flags:
        """Returns the pixels (K,) that show a draw and count."""
        return np.asarray(self.counts & (self.surfaces.object == draw))

    def factor(self, part: Array, where: Flags, channel: slice = slice(None), base: Array | None = None) -> float:
        """Returns the factor, at least 0, of a part (K, 3) of the light that explains the change best at some pixels (K,).

        It is found by least squares in what a screen shows, with less weight for pixels that do not fit (Huber 1964).
        channel: the channels that count; by default all do.
        base: optional (K, 3), the light that holds the part; by default the light of the right picture.
        """
        light = (self.surfaces.light if base is None else base)[where][:, channel]
        target, part = self.target[where][:, channel], part[where][:, channel]
        # Differences in dark places show more: the slope of the screen's curve turns light into what is seen.
        slope = np.maximum((np.abs(light) + np.abs(target)) / 2, 1e-3) ** (1 / 2.4 - 1)
        clipped = (target >= CLIPPED) if self.change.coded else np.zeros(target.shape, dtype=np.bool_)
        if clipped.all():
            return 1.0
        usual = np.where(clipped, 0.0, slope**2 * self.change.weight[where][:, None])
        weight, change = usual, 0.0
        for _ in range(4):
            below = float((weight * part**2).sum())
            if below <= 0:
                return 1.0
            change = float((weight * part * (target - light)).sum()) / below
            left = np.abs(target - light - change * part) * slope
            # An error beyond three times the median counts by its size and not by its square.
            bound = 3 * float(np.median(left[~clipped])) + 1e-6
            weight = usual * np.minimum(1.0, bound / np.maximum(left, 1e-12))
        return max(1 + change, 0.0)

    def total_share(self, light: Array) -> float:
        """Returns the share of the whole change that a fault explains. light: (K, 3), what the pixels show with the fault."""
        return self.change.explained(self.change.with_alpha(self.change.stored(light)), self.counts)

    def explains_all(self, light: Array) -> bool:
        """Returns whether a fault leaves hardly anything unexplained."""
        left = self.change.left(self.change.with_alpha(self.change.stored(light)))[self.counts]
        return bool(np.count_nonzero(left) < FEWEST) or self.total_share(light) >= COMPLETE

    @cached_property
    def considerable(self) -> tuple[int, ...]:
        """The draws with a considerable share of the change, the largest first."""
        total = float(self.change.amount[self.counts].sum())
        return tuple(draw for draw in self.objects if self.change.amount[self.of(draw)].sum() > SMALL * total)

    def share(self, light: Array, draw: int) -> float:
        """Returns the share of a draw's change that a fault explains. light: (K, 3), what the pixels show with the fault."""
        return self.change.explained(self.change.with_alpha(self.change.stored(light)), self.of(draw))


def in_doubt(fitting: Fitting) -> Iterator[int]:
    """Yields the draws with a considerable change that no fault explains yet, the largest change first."""
    yield from (draw for draw in fitting.considerable if draw not in fitting.explained)
