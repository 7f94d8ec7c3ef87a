"""Contest: measures several programs on one work. They run in turn, so that other load on the machine slows all alike."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.entrants import Entrant, ProgramError, RoundTimes, enter
from glshade.bench.stage import set_up
from glshade.bench.works import FASTEST, GLSHADE, Work
from glshade.driver.clock import Spread

# Two pictures count as the same if no channel differs by more than this [8-bit codes].
SAME = 1


@dataclass(frozen=True)
class ContestRow:
    """The result of one program.

    program: name of the program
    driver: name of its driver; None if the program did not report it
    seconds: time of the work over the rounds [s]
    whole: time over the rounds of the command of which the work is a part [s]; None if the work is not part of a command
    ratio: glshade's time divided by this program's time in the same round; None for glshade itself
    target: the largest ratio that glshade is to reach; None if there is no target
    codes: largest difference of a channel from glshade's picture [8-bit codes]
    fault: the reason why the program has no result; None if it has one
    """

    program: str
    driver: str | None = None
    seconds: Spread | None = None
    whole: Spread | None = None
    ratio: Spread | None = None
    target: float | None = None
    codes: int | None = None
    fault: str | None = None

    @property
    def same(self) -> bool:
        """Whether the picture equals glshade's, with differences of at most SAME codes."""
        return self.codes is not None and self.codes <= SAME

    @property
    def met(self) -> bool | None:
        """Whether the target is reached; None if there is no target."""
        return None if self.target is None or self.ratio is None else self.ratio.median <= self.target

    def as_dict(self) -> dict[str, Any]:
        """Returns the row as JSON types."""
        return {
            "program": self.program,
            "driver": self.driver,
            "seconds": self.seconds and self.seconds.as_dict(),
            "whole_seconds": self.whole and self.whole.as_dict(),
            "ratio": self.ratio and self.ratio.as_dict(),
            "target": self.target,
            "met": self.met,
            "codes": self.codes,
            "same_picture": None if self.codes is None else self.same,
            "fault": self.fault,
        }


def run_contest(work: Work, programs: Sequence[str], repeat: int) -> list[ContestRow]:
    """Returns the results of glshade and of the programs, glshade's first.

    The first round is not counted, because disks and drivers fill their caches in it. The row of a program that fails holds
    only the fault.
    work: the work that each program does
    programs: names of peers
    repeat: number of rounds that are counted
    Errors: ProgramError if glshade itself fails.
    """
    faults: dict[str, str] = {}
    entrants: dict[str, Entrant] = {}
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as base, ExitStack() as end:
        stage = set_up(work, Path(base))
        for name in (GLSHADE, *programs):
            folder = Path(base) / name
            folder.mkdir()
            with _excused(name, faults):
                entrants[name] = enter(name, work, stage, folder)
                end.callback(entrants[name].close)
        timings = in_turn(entrants, repeat, faults)
        pictures = {}
        for name in timings:
            with _excused(name, faults):
                pictures[name] = entrants[name].picture()
    rows = [row(name, timings, entrants[name].driver, apart(pictures[GLSHADE], drawn)) for name, drawn in pictures.items()]
    rows = [replace(result, target=target(work, result, rows)) for result in rows]
    return [*rows, *(ContestRow(name, fault=fault) for name, fault in faults.items())]


@contextmanager
def _excused(name: str, faults: dict[str, str]) -> Iterator[None]:
    """Returns a context manager within which a ProgramError is stored in `faults`, or raised if the program is glshade."""
    try:
        yield
    except ProgramError as error:
        if name == GLSHADE:
            raise
        faults[name] = str(error)


def in_turn(entrants: Mapping[str, Entrant], repeat: int, faults: dict[str, str]) -> dict[str, list[RoundTimes]]:
    """Returns each program's measurements in each round but the first: name -> measurements.

    Each round begins with a different program. A program that fails is dropped, and its message is stored in `faults`.
    """
    timings: dict[str, list[RoundTimes]] = {name: [] for name in entrants}
    for turn in range(repeat + 1):
        left = list(timings)
        first = turn % len(left)
        for name in left[first:] + left[:first]:
            with _excused(name, faults):
                timings[name].append(entrants[name].round())
            if name in faults:
                del timings[name]
    return {name: rounds[1:] for name, rounds in timings.items()}


def row(name: str, timings: Mapping[str, Sequence[RoundTimes]], driver: str | None, codes: int) -> ContestRow:
    """Returns the result of a program, without its target.

    name: name of the program
    timings: measurements of all programs, as `in_turn` returns them
    driver: name of the program's driver
    codes: largest difference of a channel from glshade's picture [8-bit codes]
    """
    theirs, ours = timings[name], timings[GLSHADE]
    wholes = [timing.whole for timing in theirs if timing.whole is not None]
    ratio = Spread.of([a.seconds / b.seconds for a, b in zip(ours, theirs, strict=True)])
    seconds = Spread.of([timing.seconds for timing in theirs])
    return ContestRow(
        name, driver, seconds, Spread.of(wholes) if wholes else None, None if name == GLSHADE else ratio, codes=codes
    )


def target(work: Work, result: ContestRow, rows: Sequence[ContestRow]) -> float | None:
    """Returns the largest ratio that glshade is to reach beside a program; None if there is no target.

    If several targets of the work apply to the program, the strictest one is returned.
    work: the work, which holds the targets
    result: the program's result
    rows: the results of all programs
    """
    if result.program == GLSHADE:
        return None
    medians = {other.program: other.seconds.median for other in rows if other.seconds and other.program != GLSHADE}
    limits = [work.targets.get(result.program)]
    if result.program == min(medians, key=medians.__getitem__):
        limits.append(work.targets.get(FASTEST))
    if result.same:
        limits.append(work.targets.get("peers"))
    return min((limit for limit in limits if limit is not None), default=None)


def apart(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> int:
    """Returns the largest difference of a channel between two pictures [8-bit codes]; 255 if their sizes differ."""
    return 255 if a.shape != b.shape else int(np.abs(a.astype(int) - b.astype(int)).max())
