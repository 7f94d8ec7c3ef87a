"""Progress of a batch: a bar on a terminal, plain lines elsewhere, or events as JSON."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import click

from glshade.cli import silence

if TYPE_CHECKING:
    from rich.progress import TaskID

    from glshade.batch.record import Record
    from glshade.batch.run import Outcome
    from glshade.batch.task import Task

# Pictures that failed and are named in the last line.
NAMED = 3


class Plain:
    """The path of every picture that is made, on stdout; faults and warnings on stderr, each once."""

    def __init__(self, manifest: str | None = None) -> None:
        self._manifest = manifest
        self._said: set[str] = set()
        self._failed: list[str] = []

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        """Nothing to say."""

    def picture(self, task: Task, record: Record) -> None:
        """Its path, or its fault."""
        for text in record.warnings:
            self.warn(text)
        if record.state == "done":
            self.path(record.output)
        elif record.state == "failed":
            self._failed.append(record.output)
            self._once(record.error)

    def path(self, output: str) -> None:
        """A picture that is made."""
        self._print(output)

    def warn(self, text: str) -> None:
        """A warning, once."""
        self._once(f"warning: {text}")

    def end(self, outcome: Outcome) -> None:
        """What failed and what is left, of several pictures."""
        if outcome.pictures == 1 or outcome.done + outcome.skipped == outcome.pictures:
            return
        words = []
        if outcome.failed:
            names = ", ".join(self._failed[:NAMED]) + ", ..." * (len(self._failed) > NAMED)
            words.append(f"{outcome.failed} of {outcome.pictures} pictures failed: {names}")
        if outcome.left:
            words.append(f"{outcome.left} of {outcome.pictures} pictures are not made: --resume goes on")
        for text in words:
            self.say(text)
        if outcome.failed and self._manifest:
            self.say(f"{self._manifest} says why")

    def say(self, text: str) -> None:
        """A line for people."""
        click.echo(f"glshade: {text}", err=True)

    def _print(self, line: str) -> None:
        """On stdout; once its reader has gone the pictures are made all the same."""
        try:
            click.echo(line)
        except BrokenPipeError:
            silence()

    def _once(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            for line in text.splitlines():
                self.say(line)


class Bar(Plain):
    """A bar on the terminal. Paths go to stdout only where that is read by something else."""

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
        """An empty bar, and who fills it."""
        self._bar.start()
        self._bar.console.print(f"{driver}, {jobs} job{'s' * (jobs > 1)}", style="dim", highlight=False)
        self._task = self._bar.add_task("", total=pictures, rate="", current="")

    def picture(self, task: Task, record: Record) -> None:
        """One step on."""
        super().picture(task, record)
        if self._task is not None:
            speed = self._bar.tasks[0].speed
            self._bar.update(self._task, advance=1, rate=f"{speed:.1f}/s" if speed else "", current=record.output)

    def path(self, output: str) -> None:
        """The bar names it."""
        if not sys.stdout.isatty():
            self._print(output)

    def say(self, text: str) -> None:
        """Above the bar."""
        self._bar.console.print(f"glshade: {text}", highlight=False, markup=False, soft_wrap=True)

    def end(self, outcome: Outcome) -> None:
        """The bar stays as it is."""
        self._bar.stop()
        super().end(outcome)


class Json(Plain):
    """Every event as one JSON object a line, on stdout; for people, stderr says what it says without."""

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        """How much there is, and what makes it."""
        self._event("begin", {"pictures": pictures, "jobs": jobs, "driver": driver})

    def picture(self, task: Task, record: Record) -> None:
        """The record, with what it was asked."""
        super().picture(task, record)
        asked: dict[str, Any] = {"scene": task.scene, "frame": task.frame, "camera": task.camera}
        asked = {key: value for key, value in asked.items() if value is not None}
        made = record.as_dict()
        self._event(made.pop("state"), asked | made)

    def path(self, output: str) -> None:
        """The event has it."""

    def end(self, outcome: Outcome) -> None:
        """The sums."""
        super().end(outcome)
        counts = {name: getattr(outcome, name) for name in ("done", "skipped", "failed", "left")}
        seconds = {"seconds": outcome.seconds, "seconds_pictures": outcome.seconds_pictures}
        self._event("end", counts | seconds)

    def _event(self, name: str, values: dict[str, Any]) -> None:
        self._print(json.dumps({"event": name, **values}))


def progress(as_json: bool, several: bool, manifest: str | None) -> Plain:
    """The one that fits who looks."""
    if as_json:
        return Json(manifest)
    return Bar(manifest) if several and sys.stderr.isatty() else Plain(manifest)
