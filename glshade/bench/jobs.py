"""Jobs: frames a second of one batch by one process and by two, in turn."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glshade.bench.entrants import Files, Took
from glshade.bench.stage import set_up
from glshade.bench.works import GLSHADE, WORKS
from glshade.driver.clock import Spread

# The least that two jobs are to do in the time of one, on two cores.
TARGET = 1.4
COUNTS = (1, 2)


@dataclass(frozen=True)
class Jobs:
    """Frames a second by number of jobs, and how many times as fast the most of them are as one, round by round."""

    rates: dict[int, Spread]
    ratio: Spread

    @classmethod
    def of(cls, frames: int, took: dict[int, Sequence[Took]]) -> Jobs:
        """From the rounds of each number of jobs; the first number is one."""
        rates = {count: [frames / one.seconds for one in found] for count, found in took.items()}
        fewest, most = rates[min(rates)], rates[max(rates)]
        ratio = Spread.of([b / a for a, b in zip(fewest, most, strict=True)])
        return cls({count: Spread.of(found) for count, found in rates.items()}, ratio)

    @property
    def met(self) -> bool:
        """Whether the target is reached."""
        return self.ratio.median >= TARGET

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        rows = [{"jobs": count, "frames_per_second": rate.as_dict()} for count, rate in self.rates.items()]
        return {"ratio": self.ratio.as_dict(), "target": TARGET, "met": self.met, "rows": rows}


def jobs(repeat: int, small: bool = False) -> Jobs:
    """Measures W4's frames. The first round is not counted. Errors: ProgramError."""
    work = WORKS["W4"].small() if small else WORKS["W4"]
    took: dict[int, list[Took]] = {count: [] for count in COUNTS}
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as folder:
        stage = set_up(work, Path(folder))
        entrants = {count: Files(GLSHADE, work, stage, Path(folder), "--jobs", str(count)) for count in COUNTS}
        for _ in range(repeat + 1):
            for count, entrant in entrants.items():
                took[count].append(entrant.round())
    return Jobs.of(work.frames, {count: found[1:] for count, found in took.items()})
