"""Run: makes a batch's pictures with an engine, and passes every record to the manifest and to the progress display."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

from glshade.batch.engine import Engine, Outcome, Progress
from glshade.batch.manifest import Manifest
from glshade.batch.record import Record
from glshade.batch.task import Task


def run_batch(
    tasks: Sequence[Task],
    engine: Engine,
    manifest: Manifest | None,
    progress: Progress,
    *,
    skipped: Sequence[Task] = (),
    since: float,
) -> Outcome:
    """Makes the pictures of the tasks and returns the outcome.

    tasks: the pictures to make
    engine: makes the pictures
    manifest: log to which every record is added; None writes no log
    progress: display that is told of every record
    skipped: tasks whose files exist already and are left alone
    since: value of `perf_counter` when the batch began [s]
    Errors: ContextError; GlshadeError if the manifest cannot be written; KeyboardInterrupt after Ctrl-C, raised once the
    pictures that were begun are finished.
    """
    by_number = {task.number: task for task in tasks}
    outcome = Outcome(len(tasks) + len(skipped), skipped=len(skipped))
    first, last = float("inf"), 0.0
    driver = engine.ready() if tasks else ""
    # A cluster knows its number of workers only when a first worker is ready.
    progress.begin(outcome.pictures, engine.jobs, driver)
    try:
        for task in skipped:
            progress.picture(task, Record(task.number, task.output, "skipped"))
        for record in engine.records(tasks):
            if manifest is not None:
                manifest.add(by_number[record.number], record)
            setattr(outcome, record.state, getattr(outcome, record.state) + 1)
            if record.seen:
                outcome.seen[record.number] = record.seen
            if record.instances:
                outcome.instances[record.number] = record.instances
            if record.state == "failed":
                outcome.codes.add(record.exit_code)
            if record.state == "done" and record.started:
                first, last = min(first, record.started), max(last, record.finished)
            if record.stops:
                engine.stop()
            progress.picture(by_number[record.number], record)
    finally:
        outcome.seconds = perf_counter() - since
        outcome.seconds_pictures = max(last - first, 0.0)
        progress.end(outcome)
    return outcome
