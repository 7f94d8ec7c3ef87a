"""Jobs: compares the frame rate of a batch with one worker process and with two."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glshade.bench.entrants import Files, RoundTimes
from glshade.bench.stage import set_up
from glshade.bench.works import GLSHADE, WORKS
from glshade.driver.clock import Spread

# The target on two cores: two jobs reach at least this many times the frame rate of one job.
TARGET = 1.4
# Numbers of jobs that are compared.
COUNTS = (1, 2)


@dataclass(frozen=True)
class Jobs:
    """The frame rates of a batch.

    rates: number of jobs -> frame rate over the rounds [1/s]
    ratio: frame rate with the most jobs divided by that with one job in the same round
    """

    rates: dict[int, Spread]
    ratio: Spread

    @classmethod
    def of(cls, frames: int, timings: dict[int, Sequence[RoundTimes]]) -> Jobs:
        """Returns the frame rates that follow from measurements.

        frames: number of frames of the batch
        timings: number of jobs -> measurements, one for each round
        """
        rates = {count: [frames / timing.seconds for timing in rounds] for count, rounds in timings.items()}
        fewest, most = rates[min(rates)], rates[max(rates)]
        ratio = Spread.of([b / a for a, b in zip(fewest, most, strict=True)])
        return cls({count: Spread.of(rounds) for count, rounds in rates.items()}, ratio)

    @property
    def met(self) -> bool:
        """Whether the target is reached."""
        return self.ratio.median >= TARGET

    def as_dict(self) -> dict[str, Any]:
        """Returns the rates as JSON types."""
        rows = [{"jobs": count, "frames_per_second": rate.as_dict()} for count, rate in self.rates.items()]
        return {"ratio": self.ratio.as_dict(), "target": TARGET, "met": self.met, "rows": rows}


def measure_jobs(repeat: int, small: bool = False) -> Jobs:
    """Measures the frames of the work W4, without the first round.

    repeat: number of rounds that are counted
    small: True measures a reduced work, to see that it works
    Errors: ProgramError.
    """
    work = WORKS["W4"].small() if small else WORKS["W4"]
    timings: dict[int, list[RoundTimes]] = {count: [] for count in COUNTS}
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as folder:
        stage = set_up(work, Path(folder))
        entrants = {count: Files(GLSHADE, work, stage, Path(folder), "--jobs", str(count)) for count in COUNTS}
        for _ in range(repeat + 1):
            for count, entrant in entrants.items():
                timings[count].append(entrant.round())
    return Jobs.of(work.frames, {count: rounds[1:] for count, rounds in timings.items()})
