"""Front: which points are worth having. One is dominated where another is faster and no worse, beyond what noise explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """Of one setting [s]: the median of the repetitions, and the range in which it would lie nineteen times of twenty."""

    median: float
    low: float
    high: float


def ties(one: Timing, other: Timing) -> bool:
    """Whether two timings cannot be told apart: their ranges overlap."""
    return one.low <= other.high and other.low <= one.high


def dominated(timings: Sequence[Timing], errors: Sequence[float]) -> list[int | None]:
    """For each point the one on the front that dominates it, None for those on the front.

    i dominates j where it is better and not slower beyond the ranges, or as good and faster beyond them. Points that are
    dominated dominate nothing, else a chain of ties would leave only the slowest. Of several, the fastest is named.
    """
    found: list[int | None] = [None] * len(timings)
    front: list[int] = []
    for j in sorted(range(len(timings)), key=lambda j: (errors[j], timings[j].median)):
        by = []
        for i in front:
            apart = not ties(timings[i], timings[j])
            slower = apart and timings[i].median > timings[j].median
            if not slower if errors[i] < errors[j] else apart and not slower:
                by.append(i)
        if by:
            found[j] = min(by, key=lambda i: (timings[i].median, errors[i]))
        else:
            front.append(j)
    return found
