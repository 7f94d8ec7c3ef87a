"""Front: which points are worth having. One is dominated where another is faster and no worse, beyond what noise explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """Of one setting [s]: the median of the repetitions, and the quartiles as its range."""

    median: float
    low: float
    high: float


def ties(one: Timing, other: Timing) -> bool:
    """Whether two timings cannot be told apart: their ranges overlap."""
    return one.low <= other.high and other.low <= one.high


def dominated(timings: Sequence[Timing], errors: Sequence[float]) -> list[int | None]:
    """For each point the one that dominates it, None for those on the front.

    i dominates j where it is faster beyond the ranges and no worse, or no slower and better. Of several, the one that is best
    on the front, by error and then by time.
    """
    count = len(timings)
    by: list[list[int]] = [[] for _ in range(count)]
    for j in range(count):
        for i in range(count):
            faster = timings[i].median < timings[j].median and not ties(timings[i], timings[j])
            no_slower = faster or ties(timings[i], timings[j])
            if (faster and errors[i] <= errors[j]) or (no_slower and errors[i] < errors[j]):
                by[j].append(i)
    found: list[int | None] = []
    for j in range(count):
        best = [i for i in by[j] if not by[i]] or by[j]
        found.append(min(best, key=lambda i: (errors[i], timings[i].median)) if best else None)
    return found
