"""Run: a batch from its tasks to its exit code; every record goes to the manifest and to whoever shows progress."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

from glshade.batch.manifest import Manifest
from glshade.batch.record import Record
from glshade.batch.task import Task

SOME_FAILED = 1


@dataclass
class Outcome:
    """What came of a batch. seconds: of all of it; seconds_pictures: from the first pixel's drawing to the last file closed."""

    pictures: int
    done: int = 0
    skipped: int = 0
    failed: int = 0
    seconds: float = 0.0
    seconds_pictures: float = 0.0
    codes: set[int] = field(default_factory=set)

    @property
    def left(self) -> int:
        """Pictures that were not begun, because something stopped the batch."""
        return self.pictures - self.done - self.skipped - self.failed

    @property
    def exit_code(self) -> int:
        """0 where all is done; what all failed by, where nothing was made; else 1."""
        if not self.failed and not self.left:
            return 0
        if len(self.codes) == 1 and not self.done and not self.skipped:
            return next(iter(self.codes))
        return SOME_FAILED


class Progress(Protocol):
    """Whoever shows what happens."""

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        """Before the first picture."""

    def picture(self, task: Task, record: Record) -> None:
        """After each."""

    def end(self, outcome: Outcome) -> None:
        """After the last, or after an interruption."""


class Engine(Protocol):
    """Whatever makes pictures: this process, a pool, a cluster."""

    jobs: int

    def ready(self) -> str:
        """Waits until there is something to draw with, and names it."""

    def records(self, tasks: Iterable[Task]) -> Iterable[Record]:
        """What comes of the tasks, in any order."""

    def stop(self) -> None:
        """Nothing more is begun."""


def run(
    tasks: Sequence[Task],
    engine: Engine,
    manifest: Manifest | None,
    progress: Progress,
    *,
    skipped: Sequence[Task] = (),
    since: float,
) -> Outcome:
    """Makes the pictures. skipped: those that are there. since: when the batch began, by perf_counter.

    Errors: ContextError; GlshadeError where the manifest cannot be written; KeyboardInterrupt, when what was begun is finished.
    """
    of = {task.number: task for task in tasks}
    outcome = Outcome(len(tasks) + len(skipped), skipped=len(skipped))
    first, last = float("inf"), 0.0
    driver = engine.ready() if tasks else ""
    # Only now does a cluster know how many workers it has.
    progress.begin(outcome.pictures, engine.jobs, driver)
    try:
        for task in skipped:
            progress.picture(task, Record(task.number, task.output, "skipped"))
        for record in engine.records(tasks):
            if manifest is not None:
                manifest.add(of[record.number], record)
            setattr(outcome, record.state, getattr(outcome, record.state) + 1)
            if record.state == "failed":
                outcome.codes.add(record.exit_code)
            if record.state == "done" and record.started:
                first, last = min(first, record.started), max(last, record.finished)
            if record.stops:
                engine.stop()
            progress.picture(of[record.number], record)
    finally:
        outcome.seconds = perf_counter() - since
        outcome.seconds_pictures = max(last - first, 0.0)
        progress.end(outcome)
    return outcome
