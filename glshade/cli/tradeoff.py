"""glshade tradeoff: what a scene's settings cost, and what they are off by."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli.render import Size, filmed, overrides

if TYPE_CHECKING:
    from glshade.tradeoff.study import Study

# Where nobody looks on, one line for each of so many parts of the work.
PARTS = 10
Progress = Callable[[str, int, int], None]


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, file_okay=False), help="Folder to write. [default: tradeoff-NAME]"
)
@click.option("--knobs", metavar="NAME,...", help="Turns these alone, such as shading,storage. [default: all of them]")
@click.option(
    "--metric",
    type=click.Choice(["max_abs", "rmse", "p999", "codes", "flip"]),
    default="max_abs",
    show_default=True,
    help="Of the front that is printed, and that the page begins with.",
)
@click.option("--repeat", type=click.IntRange(1, 1000), help="Timings of each setting, taken in turn. [default: 15]")
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@overrides
@click.option("--again", is_flag=True, help="Measures anew what the folder holds already.")
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
@click.option("--json", "as_json", is_flag=True, help="All points as JSON on stdout, in place of the tables.")
def command(
    scene: Path,
    output: Path | None,
    knobs: str | None,
    metric: str,
    repeat: int | None,
    size: tuple[int, int] | None,
    overrides: list[tuple[str, str]],
    again: bool,
    backend: Any,
    device: int | None,
    as_json: bool,
) -> None:
    """Draws SCENE at every setting that makes a difference; measures time and error, told apart by kind; finds the front.

    Writes a folder: index.html with everything in it, tradeoff.json, tradeoff.csv, pictures/, and measured.json, from which
    the same command takes up work that was interrupted.
    """
    from glshade.cli import _table
    from glshade.errors import GlshadeError
    from glshade.scene.file import load
    from glshade.tradeoff.study import REPEAT

    wanted = _knobs(knobs)
    loaded = filmed(load(scene, overrides), {"size": size})
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

    with Renderer(backend, device) as renderer:
        try:
            with _progress() as progress:
                found = study(
                    loaded, renderer, name=scene.stem, knobs=wanted, repeat=repeat or REPEAT, kept=kept, progress=progress
                )
        except KeyboardInterrupt:
            if kept.is_file():
                click.echo(f"glshade: {kept} holds what is measured; the same command takes it up", err=True)
            raise
        written = page.write(folder, found, loaded, renderer, metric)
    if as_json:
        _table.as_json(found.as_dict())
        return
    _print(found, metric)
    click.echo(f"page: {written}")


def _knobs(text: str | None) -> tuple[str, ...]:
    """The names; all stand for none. Errors: click.BadParameter with the nearest."""
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
    """The front, then what dominates each of the others, then the choices that change nothing."""
    from glshade.cli import _table
    from glshade.tradeoff.page import milliseconds, ranks, reason, shown
    from glshade.tradeoff.setting import KINDS

    points, dominators, front = study.points, study.front(metric), ranks(study, metric)
    width, height = study.size
    click.echo(f"{study.driver}; {width}x{height} pixels, {study.counted:.2%} of them counted")
    click.echo(f"{len(points)} settings, {len(front)} on the front of time and {metric}; errors by kind, which do not add up")
    rows = []
    for rank in front:
        p, t = points[rank.index], points[rank.index].timing
        rows.append(
            [
                *("tie" if rank.tie else str(rank.number), str(p.setting)),
                *(milliseconds(t.median), f"{milliseconds(t.low)} to {milliseconds(t.high)}", shown(p.error(metric), metric)),
                *(shown(getattr(p.by_kind[kind], metric), metric) for kind in KINDS),
            ]
        )
    _table.table(["", "setting", "ms", "range", metric, *KINDS], rows)
    click.echo(f"floor, from rounding the inputs: {shown(getattr(study.floor, metric), metric)}")
    for i in sorted(range(len(points)), key=lambda i: points[i].timing.median):
        by = dominators[i]
        if by is not None:
            p = points[i]
            own = f"{milliseconds(p.timing.median)} ms, {shown(p.error(metric), metric)}"
            click.echo(f"{p.setting} ({own}): dominated by {points[by].setting}, {reason(p, points[by], metric)}")
    for choice, proof in study.inert.items():
        click.echo(f"{choice} changes nothing: {proof}")


@contextmanager
def _progress() -> Iterator[Progress]:
    """A bar on a terminal, else a line now and then; on stderr."""
    import sys

    if not sys.stderr.isatty():
        told = 0

        def line(what: str, done: int, total: int) -> None:
            nonlocal told
            if done * PARTS // total > told:
                told = done * PARTS // total
                click.echo(f"glshade: {done} of {total} settings measured, the last: {what}", err=True)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        # What makes no difference is found before anything is measured.
        task = bar.add_task("settings that make a difference", total=None)
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)
