"""Contest: one work done by several programs in turn, so that whatever else the machine does falls on all of them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.entrants import Entrant, ProgramError, Took, enter
from glshade.bench.stage import set_up
from glshade.bench.works import FASTEST, GLSHADE, Work
from glshade.driver.clock import Spread

# Pictures are the same where no channel of any pixel is farther apart [codes of 255].
SAME = 1


@dataclass(frozen=True)
class Row:
    """What a program took.

    seconds, whole: as `Took`, over the rounds; ratio: glshade's time over this program's in the same round; target: the most
    that it may be; codes: the largest difference from glshade's picture; fault: why there is no figure.
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
        """Whether the picture is glshade's, to one code."""
        return self.codes is not None and self.codes <= SAME

    @property
    def met(self) -> bool | None:
        """Whether the target is reached; None without one."""
        return None if self.target is None or self.ratio is None else self.ratio.median <= self.target

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        spreads = {"seconds": self.seconds, "whole_seconds": self.whole, "ratio": self.ratio}
        return {
            "program": self.program,
            "driver": self.driver,
            **{name: spread and spread.as_dict() for name, spread in spreads.items()},
            "target": self.target,
            "met": self.met,
            "codes": self.codes,
            "same_picture": None if self.codes is None else self.same,
            "fault": self.fault,
        }


def contest(work: Work, programs: Sequence[str], repeat: int) -> list[Row]:
    """A row a program, glshade's first. The first round is not counted: disks and drivers fill their caches in it.

    A program that fails has its row, with the fault. Errors: ProgramError where it is glshade that fails.
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
        took = in_turn(entrants, repeat, faults)
        pictures = {}
        for name in took:
            with _excused(name, faults):
                pictures[name] = entrants[name].picture()
    rows = [row(name, took, entrants[name].driver, apart(pictures[GLSHADE], drawn)) for name, drawn in pictures.items()]
    rows = [replace(found, target=target(work, found, rows)) for found in rows]
    return [*rows, *(Row(name, fault=fault) for name, fault in faults.items())]


@contextmanager
def _excused(name: str, faults: dict[str, str]) -> Iterator[None]:
    """Within, what goes wrong with a program is noted; with glshade itself it is raised."""
    try:
        yield
    except ProgramError as error:
        if name == GLSHADE:
            raise
        faults[name] = str(error)


def in_turn(entrants: Mapping[str, Entrant], repeat: int, faults: dict[str, str]) -> dict[str, list[Took]]:
    """What each took in each round but the first. Who begins changes from round to round; who fails is out, with its fault."""
    took: dict[str, list[Took]] = {name: [] for name in entrants}
    for turn in range(repeat + 1):
        left = list(took)
        first = turn % len(left)
        for name in left[first:] + left[:first]:
            with _excused(name, faults):
                took[name].append(entrants[name].round())
            if name in faults:
                del took[name]
    return {name: found[1:] for name, found in took.items()}


def row(name: str, took: Mapping[str, Sequence[Took]], driver: str | None, codes: int) -> Row:
    """The row of a program, beside glshade's rounds."""
    here, ours = took[name], took[GLSHADE]
    wholes = [one.whole for one in here if one.whole is not None]
    ratio = Spread.of([a.seconds / b.seconds for a, b in zip(ours, here, strict=True)])
    seconds = Spread.of([one.seconds for one in here])
    return Row(name, driver, seconds, Spread.of(wholes) if wholes else None, None if name == GLSHADE else ratio, codes=codes)


def target(work: Work, found: Row, rows: Sequence[Row]) -> float | None:
    """The most that glshade may take beside this program, as a share of its time: the strictest that is said of it."""
    if found.program == GLSHADE:
        return None
    medians = {one.program: one.seconds.median for one in rows if one.seconds and one.program != GLSHADE}
    said = [work.targets.get(found.program)]
    if found.program == min(medians, key=medians.__getitem__):
        said.append(work.targets.get(FASTEST))
    if found.same:
        said.append(work.targets.get("peers"))
    return min((limit for limit in said if limit is not None), default=None)


def apart(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> int:
    """The largest difference of two pictures [codes]; 255 where they are not even of one size."""
    return 255 if a.shape != b.shape else int(np.abs(a.astype(int) - b.astype(int)).max())
