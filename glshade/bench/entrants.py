"""Entrants: run the programs of a contest in processes of their own, and measure one round at a time."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from glshade.bench.works import GLSHADE, Work
from glshade.errors import GlshadeError

# Smallest number of frames in a round, for works of the kind "frame". The time of the round is the median of the frames' times.
FRAMES = 5


class ProgramError(GlshadeError):
    """The exception that is raised if a program ended before it had done its work. The message has its last line of output."""


@dataclass(frozen=True)
class RoundTimes:
    """The times of one round.

    seconds: time of the work [s]
    whole: time of the command of which the work is a part [s]; None if the work is not part of a command
    """

    seconds: float
    whole: float | None = None


class Entrant(Protocol):
    """A program that does a work: the methods run it in processes of its own.

    driver: name of its driver; None if unknown
    """

    driver: str | None

    def round(self) -> RoundTimes:
        """Does the work once and returns the times. Errors: ProgramError."""

    def picture(self) -> NDArray[np.uint8]:
        """Returns the last frame, (H, W, 3) uint8, row 0 at the top."""

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
    kinds: dict[str, Callable[[str, Work, Path, Path], Entrant]] = {"frame": Frames, "files": Files, "cold": Cold}
    return kinds[work.kind](name, work, stage, folder)


class Frames:
    """A program that draws the same picture repeatedly in one process. The process times itself and answers over a pipe."""

    def __init__(self, name: str, work: Work, stage: Path, folder: Path) -> None:
        self._name, self._file = name, folder / "picture.npy"
        # stderr goes to a file, because a pipe that nobody reads would fill up and block the process.
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115 it stays open as long as the process runs
        self._process = subprocess.Popen(
            _worker(name, "serve", stage), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True
        )
        self.driver: str | None = self._answer()["driver"]

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait()
            self._errors.seek(0)
            fault = _fault(self._name, self._errors.read())
            self.close()
            raise ProgramError(fault)
        return json.loads(line)

    def _ask(self, request: int | str) -> Any:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass  # the process has ended; `_answer` raises its last message
        return self._answer()

    def round(self) -> RoundTimes:
        return RoundTimes(median(self._ask(FRAMES)))

    def picture(self) -> NDArray[np.uint8]:
        self._ask(str(self._file))
        pixels: NDArray[np.uint8] = np.load(self._file)
        return pixels[..., :3]

    def close(self) -> None:
        if not self._errors.closed:
            self._process.communicate()
            self._errors.close()


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
            self._command = _worker(name, "files", stage, self._folder)

    def round(self) -> RoundTimes:
        shutil.rmtree(self._folder, ignore_errors=True)
        whole, out = timed(self._command, self._name)
        events = [json.loads(line) for line in out.splitlines()]
        self.driver = next((event["driver"] for event in events if event.get("driver")), None)
        return RoundTimes(pictures_took(events), whole)

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
            self._command = _worker(name, "cold", stage, self._file)

    def round(self) -> RoundTimes:
        self._file.unlink(missing_ok=True)
        return RoundTimes(timed(self._command, self._name)[0])

    def picture(self) -> NDArray[np.uint8]:
        return read_codes(self._file)

    def close(self) -> None:
        self._file.unlink(missing_ok=True)


# The command `glshade render`, run by this interpreter.
RENDER = (sys.executable, "-m", "glshade", "render")


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


def timed(command: Sequence[str], name: str = GLSHADE) -> tuple[float, str]:
    """Runs a command and returns its wall-clock time [s] and its stdout. Errors: ProgramError if its exit code is not 0."""
    start = perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = perf_counter() - start
    if done.returncode:
        raise ProgramError(_fault(name, done.stderr))
    return seconds, done.stdout


def _worker(name: str, verb: str, *paths: Path) -> list[str]:
    """Returns the command line of a program's process; `glshade.bench.worker` explains the verbs and paths."""
    return [sys.executable, "-m", "glshade.bench.worker", name, verb, *map(str, paths)]


def _fault(name: str, output: str) -> str:
    """Returns a message with the last line of a program's output that mentions an error; if none does, with the last line."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line.lower()]
    last = (errors or lines or ["it printed nothing"])[-1]
    return f"{name} ended early: {last[:200]}"
