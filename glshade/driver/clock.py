"""Clock: measures how long draws take, on a machine that other processes use too.

If the CPU draws, a time is the processor time of this process with the driver's threads. One core would need as long. The wall
clock would also count the other processes. If a GPU draws, a time is that of the wall clock, from when the driver is idle until
it has finished the draw. Timer queries are not used: those of software drivers cover only a part of the work, and
`measure_timer_query` shows how large that part is.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from glshade.driver.arithmetic import load_built_in
from glshade.driver.figures import rounded
from glshade.gl.context import Context
from glshade.gl.screen import Screen

# A timer query is measured on a draw of a square with this side [pixels].
SIDE = 1024


@dataclass(frozen=True)
class Spread:
    """The spread of several measurements of one quantity, in the quantity's unit.

    median: the median of the measurements.
    low: the smallest measurement.
    high: the largest measurement.
    """

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Returns the spread of these values. Errors: statistics.StatisticsError if there are no values."""
        return cls(median(values), min(values), max(values))

    def as_dict(self) -> dict[str, float]:
        """Returns the spread as a dictionary ready for JSON."""
        return {"median": rounded(self.median), "low": rounded(self.low), "high": rounded(self.high)}


def on_cpu(context: Context) -> bool:
    """Returns whether the driver draws with threads of this process."""
    return context.is_software


def seconds(context: Context, draw: Callable[[], None]) -> float:
    """Returns the time of a draw, from when the driver is idle until it has finished [s].

    It is the time of one core if the CPU draws, and that of the wall clock if a GPU draws.
    """
    now = time.process_time if on_cpu(context) else time.perf_counter
    context.gl.finish()
    start = now()
    draw()
    context.gl.finish()
    return now() - start


def difference(context: Context, draw: Callable[[], None], without: Callable[[], None], repeat: int) -> Spread:
    """Returns by how much longer `draw` takes than `without` [s], as the spread of `repeat` measurements.

    The two draws alternate, so that other work on the machine affects both alike. The first round is left out, because drivers
    compile programs during it.
    """
    found = []
    for turn in range(repeat + 1):
        less, more = seconds(context, without), seconds(context, draw)
        if turn:
            found.append(more - less)
    return Spread.of(found)


def measure_timer_query(context: Context) -> dict[str, float]:
    """Times one draw by a timer query and by the wall clock. Returns a dictionary ready for JSON:

    "query_s": the time that the query gives [s].
    "wall_s": the time of the wall clock until the driver has finished [s].
    "share": query_s divided by wall_s.
    Errors: ShaderError.
    """
    program, screen = load_built_in(context, "pow"), Screen(context, (SIDE, SIDE))
    screen.upload(np.ones((SIDE, SIDE, 4), dtype=np.float32))
    # This first draw is not timed, because the driver compiles the program during it.
    screen.draw(program)
    context.gl.finish()
    query = context.gl.query(time=True)
    start = time.perf_counter()
    with query:
        screen.draw(program)
    context.gl.finish()
    wall = time.perf_counter() - start
    query_s = query.elapsed * 1e-9
    return {"query_s": rounded(query_s), "wall_s": rounded(wall), "share": rounded(query_s / wall)}
