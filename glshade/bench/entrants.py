"""Entrants: a program at one kind of work, in processes of its own. A round is one measurement."""

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

# Frames of a round, whose median is the round's figure.
FRAMES = 5


class ProgramError(GlshadeError):
    """A program ended before it had done its work; the message has its last line."""


@dataclass(frozen=True)
class Took:
    """One measurement [s]. whole: of the command from its start to its end, where there is one beside the figure."""

    seconds: float
    whole: float | None = None


class Entrant(Protocol):
    """A program at work."""

    driver: str | None

    def round(self) -> Took:
        """Does the work once. Errors: ProgramError."""

    def picture(self) -> NDArray[np.uint8]:
        """(H, W, 3), row 0 at the top: of the last frame."""

    def close(self) -> None:
        """Ends what runs."""


def enter(name: str, work: Work, stage: Path, folder: Path) -> Entrant:
    """The program `name`, ready; its files go to `folder`. Errors: ProgramError."""
    kinds: dict[str, Callable[[str, Work, Path, Path], Entrant]] = {"frame": Frames, "files": Files, "cold": Cold}
    return kinds[work.kind](name, work, stage, folder)


class Frames:
    """The same picture again and again in one process, which times itself and answers over a pipe."""

    def __init__(self, name: str, work: Work, stage: Path, folder: Path) -> None:
        self._name, self._file = name, folder / "picture.npy"
        self._said = tempfile.TemporaryFile("w+")  # noqa: SIM115 as long as the process: a pipe that nobody reads would fill
        self._process = subprocess.Popen(
            _worker(name, "serve", stage), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True
        )
        self.driver: str | None = self._answer()["driver"]

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait()
            self._said.seek(0)
            fault = _fault(self._name, self._said.read())
            self.close()
            raise ProgramError(fault)
        return json.loads(line)

    def _ask(self, what: int | str) -> Any:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(what) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass  # what it said last is where the answer would be
        return self._answer()

    def round(self) -> Took:
        return Took(median(self._ask(FRAMES)))

    def picture(self) -> NDArray[np.uint8]:
        self._ask(str(self._file))
        pixels: NDArray[np.uint8] = np.load(self._file)
        return pixels[..., :3]

    def close(self) -> None:
        if not self._said.closed:
            self._process.communicate()
            self._said.close()


class Files:
    """Frames to PNG files: a command each round, which says what it took from the first frame's start to the last file's end.

    options: of `glshade render`.
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

    def round(self) -> Took:
        shutil.rmtree(self._folder, ignore_errors=True)
        whole, out = timed(self._command, self._name)
        events = [json.loads(line) for line in out.splitlines()]
        self.driver = next((event["driver"] for event in events if event.get("driver")), None)
        return Took(pictures_took(events), whole)

    def picture(self) -> NDArray[np.uint8]:
        return read_codes(self._folder / f"{self._frames:04d}.png")

    def close(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)


class Cold:
    """A new process that writes one PNG file. What the driver, Python and glshade keep on disk between processes is there."""

    driver: str | None = None

    def __init__(self, name: str, work: Work, stage: Path, folder: Path) -> None:
        self._name, self._file = name, folder / "picture.png"
        if name == GLSHADE:
            self._command = [*RENDER, str(stage.with_name("scene.toml")), "-o", str(self._file)]
        else:
            self._command = _worker(name, "cold", stage, self._file)

    def round(self) -> Took:
        self._file.unlink(missing_ok=True)
        return Took(timed(self._command, self._name)[0])

    def picture(self) -> NDArray[np.uint8]:
        return read_codes(self._file)

    def close(self) -> None:
        self._file.unlink(missing_ok=True)


RENDER = (sys.executable, "-m", "glshade", "render")


def pictures_took(events: Sequence[dict[str, Any]]) -> float:
    """What a command that writes frames says at its end [s]. Errors: ProgramError where it says nothing."""
    for event in reversed(events):
        if "seconds_pictures" in event:
            return float(event["seconds_pictures"])
    raise ProgramError("the command did not say how long its pictures took")


def read_codes(path: Path) -> NDArray[np.uint8]:
    """(H, W, 3): the bytes of a picture's file, not decoded. Errors: ProgramError."""
    import OpenImageIO as oiio

    file = oiio.ImageInput.open(str(path))
    pixels = None if file is None else file.read_image("uint8")
    if pixels is None:
        raise ProgramError(f"{path} is not a picture: {oiio.geterror()}")
    found: NDArray[np.uint8] = np.asarray(pixels)[..., :3]
    return found


def timed(command: Sequence[str], name: str = GLSHADE) -> tuple[float, str]:
    """Runs a command; seconds from its start to its end, and its stdout. Errors: ProgramError."""
    start = perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    took = perf_counter() - start
    if done.returncode:
        raise ProgramError(_fault(name, done.stderr))
    return took, done.stdout


def _worker(name: str, verb: str, *paths: Path) -> list[str]:
    return [sys.executable, "-m", "glshade.bench.worker", name, verb, *map(str, paths)]


def _fault(name: str, said: str) -> str:
    """The last line that a program left, or the last that speaks of an error."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line.lower()]
    last = (errors or lines or ["without a word"])[-1]
    return f"{name} ended early: {last[:200]}"
