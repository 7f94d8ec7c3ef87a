"""Front: the settings that no other setting dominates. To dominate means to be better in time or error and worse in neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """The time of one setting.

    median: the median of repeated timings [s].
    low, high: the range in which the median would lie in 19 of 20 measurements [s].
    """

    median: float
    low: float
    high: float


def ties(one: Timing, other: Timing) -> bool:
    """Returns whether two timings cannot be told apart, because their ranges overlap."""
    return one.low <= other.high and other.low <= one.high


def dominated(timings: Sequence[Timing], errors: Sequence[float]) -> list[int | None]:
    """Returns for each of N points the index of the point on the front that dominates it, None for points on the front.

    A point dominates another one if its error is smaller and it is not slower, or if the errors are equal and it is faster.
    Times whose ranges overlap count as equal. Only points on the front dominate others: if dominated points did so too, a chain
    of points with overlapping ranges could leave only the slowest one on the front. If several points dominate one, the index
    is that of the fastest of them.

    timings: the N times.
    errors: the N errors, in any unit.
    """
    dominators: list[int | None] = [None] * len(timings)
    front: list[int] = []
    for j in sorted(range(len(timings)), key=lambda j: (errors[j], timings[j].median)):
        by = []
        for i in front:
            apart = not ties(timings[i], timings[j])
            slower = apart and timings[i].median > timings[j].median
            if not slower if errors[i] < errors[j] else apart and not slower:
                by.append(i)
        if by:
            dominators[j] = min(by, key=lambda i: (timings[i].median, errors[i]))
        else:
            front.append(j)
    return dominators
