"""Entrants: run the programs of a contest in processes of their own, and measure one round at a time."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from glshade.bench.process import Conversation, ProgramError, timed
from glshade.bench.works import GLSHADE, Work

# Smallest number of frames in a round, for works of the kind "frame". The time of the round is the median of the frames' times.
FRAMES = 5


@dataclass(frozen=True)
class RoundTimes:
    """The measurements of one round.

    seconds: time of the work [s]
    whole: time of the command of which the work is a part [s]; None if the work is not part of a command
    peak: largest resident memory of the program's largest process so far [bytes]; None if it was not measured
    """

    seconds: float
    whole: float | None = None
    peak: int | None = None


class Entrant(Protocol):
    """A program that does a work: the methods run it in processes of its own.

    driver: name of its driver; None if unknown
    """

    driver: str | None

    def round(self) -> RoundTimes:
        """Does the work once and returns the measurements. Errors: ProgramError."""

    def picture(self) -> NDArray[np.uint8] | None:
        """Returns the last frame, (H, W, 3) uint8, row 0 at the top; None if the work makes no picture."""

    def close(self) -> None:
        """Ends the process or removes the files."""


def enter(name: str, work: Work, stage: Path, folder: Path) -> Entrant:
    """Starts a program.

    name: name of the program
    work: the work that it is to do
    stage: path of the work's `WorkFiles`
    folder: folder for the program's files
    Errors: ProgramError.
    """
    if work.kind == "frame":
        return Frames(name, worker(name, "serve", stage), folder)
    kinds: dict[str, Callable[[str, Work, Path, Path], Entrant]] = {"files": Files, "cold": Cold}
    return kinds[work.kind](name, work, stage, folder)


class Frames:
    """A program that draws repeatedly in one process. The process times itself; `glshade.bench.worker` has the protocol."""

    def __init__(self, name: str, command: Sequence[str], folder: Path) -> None:
        self._file = folder / "picture.npy"
        self._talk = Conversation(name, command)
        self.driver: str | None = self._talk.first["driver"]

    def round(self) -> RoundTimes:
        times = self._talk.ask(FRAMES)
        return RoundTimes(median(times), peak=self._talk.ask("peak"))

    def picture(self) -> NDArray[np.uint8]:
        self._talk.ask(str(self._file))
        pixels: NDArray[np.uint8] = np.load(self._file)
        return pixels[..., :3]

    def close(self) -> None:
        self._talk.close()


class Files:
    """A program that writes frames to PNG files, with one command in each round.

    The command reports the time from the start of the first frame to the end of the last file. The constructor's `options` are
    further options of `glshade render`.
    """

    def __init__(self, name: str, work: Work, stage: Path, folder: Path, *options: str) -> None:
        self._name, self._folder, self._frames = name, folder / "frames", work.frames
        self.driver: str | None = None
        if name == GLSHADE:
            pattern = str(self._folder / "####.png")
            self._command = [*RENDER, str(stage.with_name("scene.toml")), "-f", f"1-{work.frames}", "-o", pattern]
            self._command += ["--json", *options]
        else:
            self._command = worker(name, "files", stage, self._folder)

    def round(self) -> RoundTimes:
        shutil.rmtree(self._folder, ignore_errors=True)
        run = timed(self._command, self._name)
        events = reports(run.out)
        self.driver = next((event["driver"] for event in events if event.get("driver")), None)
        return RoundTimes(pictures_took(events), run.seconds, run.peak)

    def picture(self) -> NDArray[np.uint8]:
        return read_codes(self._folder / f"{self._frames:04d}.png")

    def close(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)


class Cold:
    """A program that writes one PNG file in a new process.

    The driver, Python and glshade have their caches on disk filled already.
    """

    driver: str | None = None

    def __init__(self, name: str, work: Work, stage: Path, folder: Path) -> None:
        self._name, self._file = name, folder / "picture.png"
        if name == GLSHADE:
            self._command = [*RENDER, str(stage.with_name("scene.toml")), "-o", str(self._file)]
        else:
            self._command = worker(name, "cold", stage, self._file)

    def round(self) -> RoundTimes:
        self._file.unlink(missing_ok=True)
        run = timed(self._command, self._name)
        return RoundTimes(run.seconds, peak=run.peak)

    def picture(self) -> NDArray[np.uint8]:
        return read_codes(self._file)

    def close(self) -> None:
        self._file.unlink(missing_ok=True)


# The command `glshade render`, run by this interpreter.
RENDER = (sys.executable, "-m", "glshade", "render")


def reports(out: str) -> list[dict[str, Any]]:
    """Returns what a command has printed: a JSON object in each line. Errors: ProgramError."""
    try:
        return [json.loads(line) for line in out.splitlines()]
    except ValueError:
        raise ProgramError("the command printed something that is not JSON") from None


def pictures_took(events: Sequence[dict[str, Any]]) -> float:
    """Returns the time that a command reports for writing its frames [s]. Errors: ProgramError if it reports none."""
    for event in reversed(events):
        if "seconds_pictures" in event:
            return float(event["seconds_pictures"])
    raise ProgramError("the command did not say how long its pictures took")


def read_codes(path: Path) -> NDArray[np.uint8]:
    """Returns the codes of a picture file as they are stored, (H, W, 3) uint8. Errors: ProgramError."""
    import OpenImageIO as oiio

    file = oiio.ImageInput.open(str(path))
    pixels = None if file is None else file.read_image("uint8")
    if pixels is None:
        raise ProgramError(f"{path} is not a picture: {oiio.geterror()}")
    codes: NDArray[np.uint8] = np.asarray(pixels)[..., :3]
    return codes


def worker(name: str, verb: str, *paths: Path) -> list[str]:
    """Returns the command line of a program's process; `glshade.bench.worker` explains the verbs and paths."""
    return [sys.executable, "-m", "glshade.bench.worker", name, verb, *map(str, paths)]
