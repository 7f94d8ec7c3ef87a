"""Contest: measures several programs on one work. They run in turn, so that other load on the machine slows all alike."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.entrants import Entrant, RoundTimes, enter
from glshade.bench.peers import VIEWERS
from glshade.bench.process import ProgramError
from glshade.bench.stage import set_up
from glshade.bench.works import DOOR, FASTEST, GLSHADE, WORKS
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
    codes: largest difference of a channel from glshade's picture [8-bit codes]; None if the work makes no picture
    peak: largest resident memory of the program's largest process [bytes]; None if it was not measured
    beside: name of the program whose time is divided by this program's for the ratio: GLSHADE or DOOR
    fault: the reason why the program has no result; None if it has one
    """

    program: str
    driver: str | None = None
    seconds: Spread | None = None
    whole: Spread | None = None
    ratio: Spread | None = None
    target: float | None = None
    codes: int | None = None
    peak: int | None = None
    beside: str = GLSHADE
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
            "peak_bytes": self.peak,
            "beside": self.beside,
            "fault": self.fault,
        }


@dataclass(frozen=True)
class ContestTable:
    """The results of all programs at one work.

    what: description of the work
    rows: results of the programs, glshade's first
    unit: unit of the times in tables, "s" or "ms"
    limit: largest time of glshade's whole command or, if the work is not part of a command, of the work [s]; None for no limit
    over: name of the program whose time is subtracted before glshade's is compared with the limit; None for no program
    memory: largest memory of glshade [bytes]; None for no limit
    """

    what: str
    rows: list[ContestRow]
    unit: str
    limit: float | None = None
    over: str | None = None
    memory: int | None = None

    @property
    def limited(self) -> float | None:
        """glshade's time that is compared with the limit, a median [s]; None if there is none."""
        medians = {row.program: (row.whole or row.seconds) for row in self.rows}
        ours = medians.get(GLSHADE)
        if ours is None or self.over is None:
            return None if ours is None else ours.median
        less = medians.get(self.over)
        return None if less is None else ours.median - less.median

    def as_dict(self) -> dict[str, Any]:
        """Returns the table as JSON types."""
        limited = self.limited
        return {
            "what": self.what,
            "limit_seconds": self.limit,
            "limited_seconds": None if limited is None or self.limit is None else float(f"{limited:.4g}"),
            "limit_bytes": self.memory,
            "rows": [row.as_dict() for row in self.rows],
        }


def measure_work(name: str, programs: Sequence[str], repeat: int, small: bool) -> ContestTable:
    """Measures programs at one of WORKS.

    name: name of the work
    programs: names of peers
    repeat: number of rounds that are counted
    small: True measures a reduced work, to see that it works
    Errors: KeyError for an unknown work.
    """
    work = WORKS[name].small() if small else WORKS[name]
    # A program that shows mesh files takes part where the work begins with a file.
    able = [program for program in programs if work.kind == "cold" or program not in VIEWERS]
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as folder:
        stage = set_up(work, Path(folder))
        rows = run_contest(work.targets, able, lambda program, place: enter(program, work, stage, place), repeat)
    return ContestTable(work.what, rows, "s" if work.kind == "files" else "ms", work.limit)


def run_contest(
    targets: Mapping[str, float], programs: Sequence[str], enter: Callable[[str, Path], Entrant], repeat: int, warm: int = 1
) -> list[ContestRow]:
    """Returns the results of glshade and of the programs, glshade's first.

    The row of a program that fails holds only the fault. If glshade itself fails, no other program has a result.
    targets: program -> largest ratio that glshade is to reach beside it, as in `Work.targets`
    programs: names of the programs, without glshade
    enter: starts a program, of which it gets the name and a folder; raises ProgramError if the program fails
    repeat: number of rounds that are counted
    warm: number of rounds before them, in which disks and drivers fill their caches
    """
    faults: dict[str, str] = {}
    entrants: dict[str, Entrant] = {}
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as base, ExitStack() as end:
        try:
            for name in (GLSHADE, *programs):
                folder = Path(base) / name
                folder.mkdir()
                with _excused(name, faults):
                    entrants[name] = enter(name, folder)
                    end.callback(entrants[name].close)
            timings = in_turn(entrants, repeat, faults, warm)
            pictures = {}
            for name in timings:
                with _excused(name, faults):
                    pictures[name] = entrants[name].picture()
        except ProgramError as error:
            return [ContestRow(GLSHADE, fault=str(error))]
    rows = [row(name, timings, entrants[name].driver, pictures) for name in pictures]
    rows = [replace(result, target=target(targets, result, rows)) for result in rows]
    return [*rows, *(ContestRow(name, fault=fault) for name, fault in faults.items())]


@contextmanager
def _excused(name: str, faults: dict[str, str]) -> Iterator[None]:
    """Returns a context manager within which a ProgramError is stored in `faults`, or raised if the program is glshade."""
    try:
        yield
    except (ProgramError, OSError, ValueError) as error:
        if name == GLSHADE:
            raise ProgramError(str(error)) from None
        faults[name] = str(error)


def in_turn(entrants: Mapping[str, Entrant], repeat: int, faults: dict[str, str], warm: int = 1) -> dict[str, list[RoundTimes]]:
    """Returns each program's measurements in each round but the first `warm` rounds: name -> measurements.

    Each round begins with a different program. A program that fails is dropped, and its message is stored in `faults`.
    Errors: ProgramError if glshade fails.
    """
    timings: dict[str, list[RoundTimes]] = {name: [] for name in entrants}
    for turn in range(repeat + warm):
        left = list(timings)
        first = turn % len(left)
        for name in left[first:] + left[:first]:
            with _excused(name, faults):
                timings[name].append(entrants[name].round())
            if name in faults:
                del timings[name]
    return {name: rounds[warm:] for name, rounds in timings.items()}


def row(
    name: str,
    timings: Mapping[str, Sequence[RoundTimes]],
    driver: str | None,
    pictures: Mapping[str, NDArray[np.uint8] | None],
) -> ContestRow:
    """Returns the result of a program, without its target.

    A program of pyrender's scenes is compared with DOOR, if DOOR takes part; every other one with GLSHADE.
    name: name of the program
    timings: measurements of all programs, as `in_turn` returns them
    driver: name of the program's driver
    pictures: the pictures of all programs; None if the work makes none
    """
    beside = DOOR if name == "pyrender" and DOOR in pictures else GLSHADE
    theirs, ours = timings[name], timings[beside]
    wholes = [timing.whole for timing in theirs if timing.whole is not None]
    ratio = Spread.of([a.seconds / b.seconds for a, b in zip(ours, theirs, strict=True)])
    drawn, compared = pictures[name], pictures[beside]
    return ContestRow(
        program=name,
        driver=driver,
        seconds=Spread.of([timing.seconds for timing in theirs]),
        whole=Spread.of(wholes) if wholes else None,
        ratio=None if name in (GLSHADE, DOOR) else ratio,
        codes=None if drawn is None or compared is None else apart(compared, drawn),
        peak=max((timing.peak for timing in theirs if timing.peak is not None), default=None),
        beside=beside,
    )


def target(targets: Mapping[str, float], result: ContestRow, rows: Sequence[ContestRow]) -> float | None:
    """Returns the largest ratio that glshade is to reach beside a program; None if there is no target.

    If several targets apply to the program, the strictest one is returned.
    targets: the targets, as in `Work.targets`
    result: the program's result
    rows: the results of all programs
    """
    if result.program in (GLSHADE, DOOR):
        return None
    medians = {other.program: other.seconds.median for other in rows if other.seconds and other.program not in (GLSHADE, DOOR)}
    limits = [targets.get(result.program)]
    if result.program == min(medians, key=medians.__getitem__):
        limits.append(targets.get(FASTEST))
    if result.same:
        limits.append(targets.get("peers"))
    return min((limit for limit in limits if limit is not None), default=None)


def apart(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> int:
    """Returns the largest difference of a channel between two pictures [8-bit codes]; 255 if their sizes differ."""
    return 255 if a.shape != b.shape else int(np.abs(a.astype(int) - b.astype(int)).max())
