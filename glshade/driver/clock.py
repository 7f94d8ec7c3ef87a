"""Clock: how much longer one thing takes than another, on a machine that others use too.

Where the CPU draws, time is the processor time of this process, the driver's threads among it: what one core would take. The
clock on the wall would count the other processes too. Elsewhere it is the wall's, from an idle driver until it has finished.
Timer queries are not used: a software driver's see a part of the work alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from glshade.gl.context import Context


@dataclass(frozen=True)
class Spread:
    """The median of several measurements, the least and the most of them; what they are of is the caller's to say."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Errors: statistics.StatisticsError where there are none."""
        return cls(median(values), min(values), max(values))

    def as_dict(self) -> dict[str, float]:
        """For JSON."""
        return {"median": _figure(self.median), "low": _figure(self.low), "high": _figure(self.high)}


def _figure(x: float) -> float:
    """Four digits: more than a clock has."""
    return float(f"{x:.4g}")


def on_cpu(context: Context) -> bool:
    """Whether the driver draws with this process' own threads."""
    return context.is_software


def seconds(context: Context, draw: Callable[[], None]) -> float:
    """From an idle driver until it has finished: of one core where the CPU draws, else by the clock on the wall."""
    now = time.process_time if on_cpu(context) else time.perf_counter
    context.gl.finish()
    start = now()
    draw()
    context.gl.finish()
    return now() - start


def difference(context: Context, draw: Callable[[], None], without: Callable[[], None], repeat: int) -> Spread:
    """How much longer `draw` takes than `without` [s].

    They take turns, so that whatever else the machine does falls on both. The first round of each is not counted: drivers
    compile in it.
    """
    found = []
    for turn in range(repeat + 1):
        less, more = seconds(context, without), seconds(context, draw)
        if turn:
            found.append(more - less)
    return Spread.of(found)
