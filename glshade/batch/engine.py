"""Engine: the interface that this process, a pool and a cluster share, and the constants and functions common to them."""

from __future__ import annotations

import signal
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Protocol

from glshade.batch.record import Record
from glshade.batch.task import Task

# Exit code of a batch in which some pictures failed or were not begun.
SOME_FAILED = 1
# Default number of times that a picture is made again after its worker died.
RETRIES = 2
# Number of threads that write files, for each thread that draws: to encode a PNG takes up to twice as long as to draw it.
WRITERS = 2
# If pictures take longer than this [s], a worker gets its next one only when it is idle. A picture that waits for a busy worker
# could be begun earlier by another worker.
SLOW = 0.5


@dataclass
class Outcome:
    """The result of a batch.

    pictures: number of pictures in the batch
    done: number of pictures that were made
    skipped: number of pictures that were not made because their files exist already
    failed: number of pictures that failed
    seconds: time of the whole batch [s]
    seconds_pictures: time from the start of the first picture's drawing until the last file was closed [s]
    codes: exit codes of the failed pictures
    seen: number of a picture -> how it was seen, for the pictures that were drawn
    instances: number of a picture -> the objects that it shows, for the pictures that were drawn with `Task.instances`
    """

    pictures: int
    done: int = 0
    skipped: int = 0
    failed: int = 0
    seconds: float = 0.0
    seconds_pictures: float = 0.0
    codes: set[int] = field(default_factory=set)
    seen: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    instances: dict[int, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def left(self) -> int:
        """The number of pictures that were not begun because the batch was stopped."""
        return self.pictures - self.done - self.skipped - self.failed

    @property
    def exit_code(self) -> int:
        """The exit code of the batch: 0 if all pictures exist, and 1 otherwise; but if all failed with one code, that code."""
        if not self.failed and not self.left:
            return 0
        if len(self.codes) == 1 and not self.done and not self.skipped:
            return next(iter(self.codes))
        return SOME_FAILED


class Progress(Protocol):
    """A display of a batch's progress."""

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        """Is called before the first picture."""

    def picture(self, task: Task, record: Record) -> None:
        """Is called after each picture."""

    def end(self, outcome: Outcome) -> None:
        """Is called after the last picture, or after an interruption."""


class Engine(Protocol):
    """A maker of pictures: this process, a pool or a cluster.

    jobs: number of pictures that are made at the same time
    """

    jobs: int

    def ready(self) -> str:
        """Waits until a driver is ready and returns its name."""

    def records(self, tasks: Iterable[Task]) -> Iterable[Record]:
        """Yields the tasks' records, in any order."""

    def stop(self) -> None:
        """Lets no further picture begin."""


@contextmanager
def interrupts(stop: Any) -> Iterator[list[bool]]:
    """Returns a context manager within which the first Ctrl-C calls `stop` and the second raises KeyboardInterrupt.

    It yields a list, which is empty until the first Ctrl-C.
    """
    interrupted: list[bool] = []

    def handle(*_: Any) -> None:
        if interrupted:
            raise KeyboardInterrupt
        interrupted.append(True)
        stop()

    try:
        before = signal.signal(signal.SIGINT, handle)
    except ValueError:
        # Only the main thread may set signal handlers. On any other thread, the handling of Ctrl-C is not changed.
        yield interrupted
        return
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)


def fault(number: int, output: str, error: Exception) -> Record:
    """Prints the traceback of an error that glshade does not expect, and returns the record of a failed picture.

    Such an error is a bug in glshade; the other pictures are made all the same.
    """
    traceback.print_exc()
    return Record(number, output, "failed", error=f"{output}: {type(error).__name__}: {error}", exit_code=1)
