"""Progress: displays the progress of a batch, as a bar on a terminal, as plain lines elsewhere, or as events in JSON."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import click

from glshade.batch import events
from glshade.cli import silence
from glshade.errors import printable

if TYPE_CHECKING:
    from rich.progress import TaskID

    from glshade.batch.engine import Outcome
    from glshade.batch.record import Record
    from glshade.batch.task import Task

# Largest number of failed pictures that the last line names.
NAMED = 3


class Plain:
    """Prints the path of every picture that is made to stdout, and each error and warning once to stderr."""

    def __init__(self, manifest: str | None = None) -> None:
        self._manifest = manifest
        self._printed: set[str] = set()
        self._failed: list[str] = []

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        """Prints nothing."""

    def picture(self, task: Task, record: Record) -> None:
        """Prints the warnings of a picture, and its path or its error."""
        for text in record.warnings:
            self.warn(text)
        if record.state == "done":
            self.path(record.output)
        elif record.state == "failed":
            self._failed.append(record.output)
            self._once(record.error)

    def path(self, output: str) -> None:
        """Prints the path of a picture that is made."""
        self._print(printable(output))

    def warn(self, text: str) -> None:
        """Prints a warning, unless it was printed before."""
        self._once(f"warning: {text}")

    def end(self, outcome: Outcome) -> None:
        """Prints which of several pictures failed, and how many were not begun."""
        if outcome.pictures == 1 or outcome.done + outcome.skipped == outcome.pictures:
            return
        if outcome.failed:
            names = [*self._failed[:NAMED], "..."] if len(self._failed) > NAMED else self._failed
            self.say(f"{outcome.failed} of {outcome.pictures} pictures failed: {', '.join(names)}")
        if outcome.left:
            self.say(f"{outcome.left} of {outcome.pictures} pictures were not begun: continue with --resume")
        if outcome.failed and self._manifest:
            self.say(f"{self._manifest} holds the reasons")

    def say(self, text: str) -> None:
        """Prints a line for the user to stderr."""
        click.echo(f"glshade: {printable(text)}", err=True)

    def _print(self, line: str) -> None:
        """Prints a line to stdout. If the reader of stdout has gone, the pictures are made all the same."""
        try:
            click.echo(line)
        except BrokenPipeError:
            silence()

    def _once(self, text: str) -> None:
        """Prints a text of one or more lines to stderr, unless it was printed before."""
        if text not in self._printed:
            self._printed.add(text)
            for line in text.split("\n"):
                self.say(line)


class Bar(Plain):
    """Shows a bar on the terminal. Paths are printed only if stdout is not a terminal, because they would break the bar."""

    def __init__(self, manifest: str | None = None) -> None:
        super().__init__(manifest)
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        self._bar = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[current]}"),
            console=Console(stderr=True),
        )
        self._task: TaskID | None = None

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        """Shows an empty bar, below the driver and the number of jobs."""
        self._bar.start()
        self._bar.console.print(f"{driver}, {jobs} job{'s' if jobs > 1 else ''}", style="dim", highlight=False)
        self._task = self._bar.add_task("", total=pictures, rate="", current="")

    def picture(self, task: Task, record: Record) -> None:
        """Advances the bar by one picture, and shows its path there."""
        super().picture(task, record)
        if self._task is not None:
            speed = self._bar.tasks[0].speed
            self._bar.update(self._task, advance=1, rate=f"{speed:.1f}/s" if speed else "", current=printable(record.output))

    def path(self, output: str) -> None:
        """Prints the path if stdout is not a terminal. The bar shows it in any case."""
        if not sys.stdout.isatty():
            self._print(printable(output))

    def say(self, text: str) -> None:
        """Prints a line above the bar."""
        self._bar.console.print(f"glshade: {printable(text)}", highlight=False, markup=False, soft_wrap=True)

    def end(self, outcome: Outcome) -> None:
        """Stops the bar and leaves it on the terminal."""
        self._bar.stop()
        super().end(outcome)


class Json(Plain):
    """Prints every event to stdout, one JSON object a line. stderr has the same lines as without --json."""

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        """Prints the number of pictures, the number of jobs and the driver."""
        self._event(events.began(pictures, jobs, driver))

    def picture(self, task: Task, record: Record) -> None:
        """Prints the record, with the scene, frame and camera of its task."""
        super().picture(task, record)
        self._event(events.picture(task, record))

    def path(self, output: str) -> None:
        """Prints nothing, because the event holds the path."""

    def end(self, outcome: Outcome) -> None:
        """Prints the numbers of pictures and the times."""
        super().end(outcome)
        self._event(events.ended(outcome))

    def _event(self, event: dict[str, Any]) -> None:
        self._print(json.dumps(event))


def progress(as_json: bool, several: bool, manifest: str | None) -> Plain:
    """Returns the display for a batch.

    as_json: True prints events as JSON
    several: True if there is more than one picture, for which a terminal shows a bar
    manifest: path of the manifest, which is printed after failures; None if there is no manifest
    """
    if as_json:
        return Json(manifest)
    return Bar(manifest) if several and sys.stderr.isatty() else Plain(manifest)
