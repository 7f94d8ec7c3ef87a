"""Command `glshade tradeoff`: measures the time and the error of a scene's settings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import Size, driver, filmed, limits, models, overrides, shaders
from glshade.limits import Limits

if TYPE_CHECKING:
    from glshade.tradeoff.study import Study

# Largest number of progress lines that are printed if stderr is not a terminal.
PARTS = 10
# A function that shows progress. Its arguments: the setting in words, the number of settings measured, the number of all
# settings.
Progress = Callable[[str, int, int], None]


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, file_okay=False), help="Folder for the results. [default: tradeoff-NAME]"
)
@click.option("--knobs", metavar="NAME,...", help="Varies only these knobs, such as shading,storage. [default: all]")
@click.option(
    "--metric",
    type=click.Choice(["max_abs", "rmse", "p999", "codes", "flip"]),
    default="max_abs",
    show_default=True,
    help="Measure of error for the front that is printed, and with which the page begins.",
)
@click.option("--repeat", type=click.IntRange(1, 1000), help="Number of timings of each setting. [default: 15]")
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@limits
@overrides
@click.option("--again", is_flag=True, help="Repeats the measurements that the folder already holds.")
@driver
@shaders
@models
@click.option("--json", "as_json", is_flag=True, help="Prints all settings as JSON instead of the tables.")
def command(
    scene: Path,
    output: Path | None,
    knobs: str | None,
    metric: str,
    repeat: int | None,
    size: tuple[int, int] | None,
    overrides: list[tuple[str, str]],
    limits: Limits,
    again: bool,
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    as_json: bool,
) -> None:
    """Measures time and error of SCENE's settings.

    Draws SCENE at every setting that makes a difference, and finds the Pareto front of time and error. Errors
    are measured by kind: model, sampling, arithmetic and storage.

    The command writes a folder with index.html (which contains everything), tradeoff.json, tradeoff.csv, pictures/, and
    measured.json, from which the same command continues after an interruption.
    """
    from glshade.cli import _table
    from glshade.errors import GlshadeError
    from glshade.scene.file import load
    from glshade.tradeoff.study import REPEAT

    wanted = _knobs(knobs)
    loaded = filmed(load(scene, overrides, limits=limits), {"size": size})
    folder = output or Path(f"tradeoff-{scene.stem.removeprefix('tradeoff-')}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadeError(f"{folder}: cannot be made: {error.strerror}") from None
    kept = folder / "measured.json"
    if again:
        kept.unlink(missing_ok=True)

    from glshade.gl.renderer import Renderer
    from glshade.tradeoff import page
    from glshade.tradeoff.study import study

    with Renderer(backend, device, shaders=shaders) as renderer:
        try:
            with _progress() as progress:
                result = study(
                    loaded, renderer, name=scene.stem, knobs=wanted, repeat=repeat or REPEAT, kept=kept, progress=progress
                )
        except KeyboardInterrupt:
            if kept.is_file():
                click.echo(f"glshade: {kept} holds the measurements so far; the same command continues from them", err=True)
            raise
        written = page.write(folder, result, loaded, renderer, metric)
    if as_json:
        _table.as_json(result.as_dict())
        return
    _print(result, metric)
    click.echo(f"page: {written}")


def _knobs(text: str | None) -> tuple[str, ...]:
    """Returns the names in a text such as shading,storage. Errors: click.BadParameter for an unknown knob."""
    from dataclasses import fields

    from glshade.document import nearest
    from glshade.tradeoff.setting import Setting

    known = {f.name: f for f in fields(Setting)}
    chosen = tuple(dict.fromkeys(name.strip() for name in (text or "").split(",") if name.strip()))
    for name in chosen:
        if name not in known:
            raise click.BadParameter(f"no knob is named {name!r}{nearest(name, known)}", param_hint="'--knobs'")
    return chosen


def _print(study: Study, metric: str) -> None:
    """Prints the front, then each dominated setting with one that dominates it, then the values that change nothing."""
    from glshade.cli import _table
    from glshade.tradeoff.page import error_text, milliseconds, ranks, reason
    from glshade.tradeoff.setting import KINDS

    points, dominators, front = study.points, study.front(metric), ranks(study, metric)
    width, height = study.size
    click.echo(f"{study.driver}; {width}x{height} pixels, {study.counted:.2%} of them counted")
    click.echo(
        f"{len(points)} settings, {len(front)} on the front of time and {metric}; the errors by kind do not add up to the total"
    )
    rows = []
    for rank in front:
        p, t = points[rank.index], points[rank.index].timing
        rows.append(
            [
                "tie" if rank.tie else str(rank.number),
                str(p.setting),
                milliseconds(t.median),
                f"{milliseconds(t.low)} to {milliseconds(t.high)}",
                error_text(p.error(metric), metric),
                *(error_text(getattr(p.by_kind[kind], metric), metric) for kind in KINDS),
            ]
        )
    _table.table(["", "setting", "ms", "range", metric, *KINDS], rows)
    click.echo(f"error from rounding the inputs to float32 alone: {error_text(getattr(study.floor, metric), metric)}")
    for i in sorted(range(len(points)), key=lambda i: points[i].timing.median):
        dominator = dominators[i]
        if dominator is not None:
            p = points[i]
            own = f"{milliseconds(p.timing.median)} ms, {error_text(p.error(metric), metric)}"
            click.echo(f"{p.setting} ({own}): dominated by {points[dominator].setting}, {reason(p, points[dominator], metric)}")
    for choice, proof in study.inert.items():
        click.echo(f"{choice} changes nothing: {proof}")


@contextmanager
def _progress() -> Iterator[Progress]:
    """Returns a context manager that yields a function to show progress on stderr: a bar on a terminal, elsewhere up to PARTS
    lines.
    """
    import sys

    if not sys.stderr.isatty():
        printed = 0

        def line(what: str, done: int, total: int) -> None:
            nonlocal printed
            if done * PARTS // total > printed:
                printed = done * PARTS // total
                click.echo(f"glshade: {done} of {total} settings measured, the last: {what}", err=True)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        # The number of settings is unknown at first: the study begins by dropping settings that make no difference.
        task = bar.add_task("settings that make a difference", total=None)
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)
