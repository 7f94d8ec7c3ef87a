"""Command `glshade bench`: measures the speed of glshade on the driver at hand. Each subcommand is a function here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import driver, models, shaders

if TYPE_CHECKING:
    from glshade.bench.corpus.table import Tally
    from glshade.bench.report import BenchReport

# Further names that `work` takes: they stand for measurements of glshade alone.
MEASURED_BESIDE = ("growth", "jobs")


class Bench(click.Group):
    """A command group whose default subcommand is `work`, as in `glshade bench W1` and `glshade bench --json`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args or args[0] not in (*self.commands, *ctx.help_option_names):
            args = ["work", *args]
        return super().parse_args(ctx, args)


@click.group(cls=Bench)
def command() -> None:
    """Measures the speed of glshade.

    All times are wall-clock times on the driver at hand. The default subcommand is `work`, which draws the same
    pictures by glshade and by other programs: `glshade bench W1` is `glshade bench work W1`.
    """


def _reported(function: Callable[..., None]) -> Callable[..., None]:
    """Adds the options of a subcommand that measures works and reports on them."""
    options = (
        click.option(
            "--size", type=click.Choice(["full", "small"]), default="full", help="small: reduced works, to see that they run."
        ),
        click.option("--json", "as_json", is_flag=True, help="Prints the results as one JSON object."),
        click.option("--markdown", "as_markdown", is_flag=True, help="Prints the tables of docs/benchmarks.md."),
        click.option(
            "--save", type=click.Path(path_type=Path, dir_okay=False), help="Also writes the JSON object to this file."
        ),
    )
    # Decorators are applied from the last to the first.
    for option in reversed(options):
        function = option(function)
    return function


@command.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option(
    "--peers", multiple=True, metavar="NAME", help="Compares only with this peer, and with moderngl by hand; repeatable."
)
@click.option(
    "--repeat",
    type=click.IntRange(1, 1000),
    default=5,
    show_default=True,
    help="Number of rounds; each program runs once in each.",
)
@_reported
def work(
    names: tuple[str, ...], peers: tuple[str, ...], repeat: int, size: str, as_json: bool, as_markdown: bool, save: Path | None
) -> None:
    """Times glshade beside other programs at each NAME, or at all of W1 W2 W3 W3s W4 W5 growth jobs.

    The other programs are one written by hand with moderngl, and those of pyrender, Mitsuba, VTK and Panda3D that are
    installed (`pip install 'glshade[peers]'`). They run in turn, each in a process of its own; docs/benchmarks.md explains how.
    """
    from glshade.bench.contest import measure_work
    from glshade.bench.growth import SERIES, measure_growth
    from glshade.bench.jobs import measure_jobs
    from glshade.bench.peers import installed
    from glshade.bench.report import BenchReport
    from glshade.bench.works import BY_HAND, WORKS
    from glshade.cli import _table

    if as_json and as_markdown:
        raise click.UsageError("--json and --markdown exclude each other")
    wanted = _table.chosen(names, dict.fromkeys((*WORKS, *MEASURED_BESIDE)), "work")
    chosen_peers = _table.chosen(peers, dict.fromkeys(installed()), "installed peer")
    programs = list(dict.fromkeys((BY_HAND, *chosen_peers)))
    small = size == "small"
    report = BenchReport(repeat, small)
    for name in dict.fromkeys(wanted):
        click.echo(f"{name} ...", err=True)
        if name == "growth":
            report.growths = [measure_growth(what, repeat, small) for what in SERIES]
        elif name == "jobs":
            report.jobs = measure_jobs(repeat, small)
        else:
            report.contests[name] = measure_work(name, programs, repeat, small)
    _show(report, as_json, as_markdown, save)


@command.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--peers", multiple=True, metavar="NAME", help="Compares only with the programs of this library; repeatable.")
@click.option(
    "--repeat",
    type=click.IntRange(1, 1000),
    default=5,
    show_default=True,
    help="Number of rounds; the largest works have fewer.",
)
@_reported
def life(
    names: tuple[str, ...], peers: tuple[str, ...], repeat: int, size: str, as_json: bool, as_markdown: bool, save: Path | None
) -> None:
    """Times what people wait for: new textures, moving meshes, many objects, large files, start-up.

    The works are W6 to W21, and L1 to L3, which are larger and measured only if they are named. They run beside the programs
    of `glshade bench work` and some more; docs/benchmarks.md explains each.
    """
    from glshade.bench.life import homes, installed, work
    from glshade.bench.life_contest import measure_life
    from glshade.bench.report import BenchReport
    from glshade.bench.works import DOOR
    from glshade.cli import _table

    if as_json and as_markdown:
        raise click.UsageError("--json and --markdown exclude each other")
    works = {name: work(name) for name in homes()}
    offered = dict.fromkeys(name.split()[0] for each in works.values() for name in installed(each.programs))
    libraries = {DOOR, *_table.chosen(peers, offered, "installed peer")}
    report = BenchReport(repeat, size == "small")
    wanted = _table.chosen(names, works, "work") if names else [name for name, each in works.items() if not each.on_request]
    for name in dict.fromkeys(wanted):
        click.echo(f"{name} ...", err=True)
        programs = [program for program in installed(works[name].programs) if program.split()[0] in libraries]
        report.contests[name] = measure_life(name, programs, repeat, report.small)
    _show(report, as_json, as_markdown, save)


def _show(report: BenchReport, as_json: bool, as_markdown: bool, save: Path | None) -> None:
    """Prints a report, as JSON, as Markdown or as tables for people, and writes the JSON to the file `save`.

    Errors: GlshadeError if glshade itself failed at a work, after the report is printed.
    """
    import json

    from glshade.bench.report import markdown
    from glshade.cli import _table
    from glshade.errors import GlshadeError
    from glshade.files import replacing

    if save is not None:
        with replacing(save) as beside:
            beside.write_text(json.dumps(report.as_dict(), indent=1) + "\n", encoding="utf-8")
    if as_json:
        _table.as_json(report.as_dict())
    elif as_markdown:
        click.echo(markdown(report), nl=False)
    else:
        _print(report)
    if failed := report.failed:
        raise GlshadeError(f"glshade could not be measured at {', '.join(failed)}; the reasons are in the tables")


def _print(report: BenchReport) -> None:
    """Prints the report as tables for people."""
    from glshade.cli import _table

    for line in report.heading():
        click.echo(line)
    for title, (heads, *rows) in report.tables():
        click.echo()
        _table.title(title)
        _table.table(heads, rows)


@command.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@driver
@shaders
@models
@click.option(
    "--repeat", type=click.IntRange(1, 1000), default=7, show_default=True, help="Number of measurements of each model."
)
@click.option("--json", "as_json", is_flag=True, help="Prints the results as one JSON object.")
def brdfs(
    names: tuple[str, ...],
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    repeat: int,
    as_json: bool,
) -> None:
    """Measures the cost of each reflectance model NAME, or of all of them.

    The figures are those of one evaluation, with the defaults and with each option: the time at a pixel and at a vertex in
    nanoseconds, as median and range; the operations, or "-" if the driver does not show them; and the bytes of GLSL.
    """
    from glshade.bench.brdfs import costs, table
    from glshade.brdfs import BRDFS
    from glshade.cli import _table

    measured = costs(_table.chosen(names, BRDFS, "model"), repeat, backend, device, shaders)
    if as_json:
        _table.as_json(measured.as_dict())
        return
    click.echo(f"{measured.renderer}; {measured.version}")
    clock = "of one core" if measured.clock == "core" else "of wall-clock time"
    click.echo(f"{measured.threads} threads; nanoseconds {clock} for one evaluation, median and range of {repeat}")
    heads, *rows = table(measured)
    _table.table(heads, rows)


@command.command()
@driver
@click.option(
    "--repeat",
    type=click.IntRange(1, 1000),
    default=20,
    show_default=True,
    help="Number of edits of each kind that are counted.",
)
@click.option("--json", "as_json", is_flag=True, help="Prints the results as one JSON object.")
def live(backend: Any, device: int | None, repeat: int, as_json: bool) -> None:
    """Measures `glshade dev`: an edit, a movement, and waiting.

    The figures are the time from an edit of one, two and three shader programs to the picture at 512x512, with its steps;
    the pictures a second while the camera or a slider moves; and the share of a core that a server takes while nothing happens.
    """
    from glshade.bench.live import measure_live
    from glshade.cli import _table

    measured = measure_live(repeat, backend, device)
    if as_json:
        _table.as_json(measured.as_dict())
        return
    click.echo(measured.driver)
    heads, *rows = measured.table()
    _table.table(heads, rows)


@command.command()
@click.option(
    "--corpus", type=click.Path(path_type=Path, file_okay=False), metavar="FOLDER", help="Folder for the pairs of pictures."
)
@click.option("--judge", "judges", multiple=True, metavar="NAME", help="Judges only with this tool; repeatable.")
@click.option("--count", type=click.IntRange(1), metavar="N", help="Takes only N pairs, which are chosen at random.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Number from which what is random follows.")
@click.option("--speed", is_flag=True, help="Measures the time of comparisons instead.")
@click.option("--json", "as_json", is_flag=True, help="Prints the results as one JSON object, with every pair.")
@click.option("--markdown", "as_markdown", is_flag=True, help="Prints the tables of docs/benchmarks.md.")
def compare(
    corpus: Path | None, judges: tuple[str, ...], count: int | None, seed: int, speed: bool, as_json: bool, as_markdown: bool
) -> None:
    """Measures `glshade compare` beside other tools: which regressions they find, and which noise they take for one.

    The pairs are pictures of ten small scenes with faults at three strengths, and with differences that a right driver may
    make. They are drawn into FOLDER, and what is there already is not drawn again, so that an interrupted run can go on. With
    --speed, 1,000 pairs (or --count) are compared in a temporary folder, and only the times are told.
    """
    from glshade.cli import _table

    if as_json and as_markdown:
        raise click.UsageError("--json and --markdown exclude each other")
    if speed == (corpus is not None):
        raise click.UsageError("give either --corpus FOLDER or --speed")
    if speed:
        if judges:
            raise click.UsageError("--judge chooses among the tools that judge a corpus; --speed measures glshade alone")
        from glshade.bench.corpus.speed import PAIRS, measure_speed

        measured = measure_speed(count or PAIRS)
        if as_json:
            _table.as_json(measured.as_dict())
        else:
            _print_table(*measured.table(), as_markdown=as_markdown)
        return
    assert corpus is not None
    tally = _judged(corpus, judges, count, seed)
    if as_json:
        _table.as_json(tally.as_dict())
        return
    from glshade.bench.corpus.table import HEADS, listed

    _print_table(HEADS, [row.cells() for row in tally.rows()], as_markdown=as_markdown)
    for row in tally.rows():
        click.echo(f"\n{row.title}: missed: {listed(row.missed)}\n{row.title}: false alarms: {listed(row.alarming)}")
    if tally.inapplicable:
        click.echo(
            f"\n{tally.inapplicable} pairs were not made: the kind does not apply to the scene, or the driver is not there"
        )


def _judged(corpus: Path, names: tuple[str, ...], count: int | None, seed: int) -> Tally:
    """Makes and judges the pairs of a corpus, with progress on stderr. Errors: click.UsageError, GlshadeError."""
    from rich.console import Console
    from rich.progress import track

    from glshade.bench.corpus.judges import JUDGES
    from glshade.bench.corpus.judging import available, judged
    from glshade.bench.corpus.making import Item, planned
    from glshade.bench.corpus.table import Tally
    from glshade.cli import _table

    def note(text: str) -> None:
        tally.notes.append(text)
        click.echo(f"glshade: {text}", err=True)

    tally = Tally()
    items = planned(count, seed)
    chosen = available(_table.chosen(names, JUDGES, "judge"), note)
    pairs = judged(corpus, items, chosen, seed, report=note)
    # rich draws the bar on a terminal only.
    for pair in track(pairs, "Pairs", total=len(items), console=Console(stderr=True)):
        if isinstance(pair, Item):
            tally.inapplicable += 1
        else:
            tally.judged.append(pair)
    return tally


def _print_table(heads: list[str], rows: list[list[str]], as_markdown: bool) -> None:
    """Prints a table for people, or as Markdown."""
    if not as_markdown:
        from glshade.cli import _table

        _table.table(heads, rows)
        return
    for cells in (heads, ["---"] * len(heads), *rows):
        click.echo(f"| {' | '.join(cells)} |")
