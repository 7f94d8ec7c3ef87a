"""Contests of `life`: run the programs of its works in processes of their own, and measure one round at a time."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.contest import ContestTable, run_contest
from glshade.bench.entrants import FRAMES, Entrant, RoundTimes, read_codes
from glshade.bench.life import LifeWork, homes, work
from glshade.bench.process import Conversation, timed


def measure_life(name: str, programs: Sequence[str], repeat: int, small: bool) -> ContestTable:
    """Measures programs at a work.

    name: name of the work
    programs: names of the programs, without GLSHADE
    repeat: number of rounds that are counted, unless the work allows fewer
    small: True measures a reduced work, to see that it works
    Errors: KeyError for an unknown work.
    """
    chosen = work(name)
    size = chosen.small if small else chosen.size
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as folder:
        files = Path(folder)
        if chosen.set_up is not None:
            chosen.set_up(size, files)
        start = partial(enter, name, chosen, size, files)
        rows = run_contest(chosen.targets, programs, start, min(repeat, chosen.rounds), chosen.warm)
    # What adds to the start of Python takes milliseconds; other whole processes and first pictures take seconds.
    unit = "ms" if chosen.kind == "again" or chosen.over else "s"
    return ContestTable(chosen.what, rows, unit, chosen.limit, chosen.over, chosen.memory)


def enter(work_name: str, work: LifeWork, size: int, files: Path, name: str, folder: Path) -> Entrant:
    """Starts a program.

    work_name, work: the work
    size: its size
    files: folder of the work's files
    name: name of the program
    folder: folder for the program's files
    Errors: ProgramError.
    """
    command = [sys.executable, "-m", "glshade.bench.life._process", homes()[work_name], work_name, name, str(size), str(files)]
    program = work.programs[name]
    if work.kind == "again":
        return Again(name, [*command, "serve"], folder)
    if work.kind == "first":
        return First(name, [*command, "serve"], folder)
    if hasattr(program, "command"):
        picture = folder / "picture.png"
        return Whole(name, program.command(size, files, picture), picture, getattr(program, "environment", {}))
    picture = folder / "picture.npy"
    return Whole(name, [*command, "once", str(picture)], picture, {})


class Again:
    """A program that draws one picture after another in one process."""

    driver: str | None = None

    def __init__(self, name: str, command: list[str], folder: Path) -> None:
        self._file = folder / "picture.npy"
        self._talk = Conversation(name, command)

    def round(self) -> RoundTimes:
        return RoundTimes(median(self._talk.ask(FRAMES)), peak=self._talk.ask("peak"))

    def picture(self) -> NDArray[np.uint8]:
        self.driver = self._talk.ask(str(self._file))
        return _codes(self._file)

    def close(self) -> None:
        self._talk.close()


class First:
    """A program that draws its first picture in a new process in each round."""

    driver: str | None = None

    def __init__(self, name: str, command: list[str], folder: Path) -> None:
        self._name, self._command, self._file = name, command, folder / "picture.npy"

    def round(self) -> RoundTimes:
        talk = Conversation(self._name, self._command)
        seconds = talk.ask("first")[0]
        peak = talk.ask("peak")
        self.driver = talk.ask(str(self._file))
        talk.close()
        return RoundTimes(seconds, peak=peak)

    def picture(self) -> NDArray[np.uint8]:
        return _codes(self._file)

    def close(self) -> None:
        self._file.unlink(missing_ok=True)


class Whole:
    """A program whose whole process is measured in each round."""

    driver: str | None = None

    def __init__(self, name: str, command: list[str], picture: Path, environment: Any) -> None:
        self._name, self._command, self._file, self._environment = name, command, picture, environment

    def round(self) -> RoundTimes:
        self._file.unlink(missing_ok=True)
        with tempfile.TemporaryDirectory(prefix="glshade-bench-") as empty:
            run = timed(self._command, self._name, {name: f"{empty}/{folder}" for name, folder in self._environment.items()})
        return RoundTimes(run.seconds, peak=run.peak)

    def picture(self) -> NDArray[np.uint8] | None:
        if not self._file.is_file():
            return None
        return _codes(self._file) if self._file.suffix == ".npy" else read_codes(self._file)

    def close(self) -> None:
        self._file.unlink(missing_ok=True)


def _codes(path: Path) -> NDArray[np.uint8]:
    pixels: NDArray[np.uint8] = np.load(path)
    return pixels[..., :3]
