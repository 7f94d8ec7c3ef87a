"""glshade bench: what things cost on the driver at hand. One subcommand a function of this module."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from glshade.bench.report import Report

MEASURED_BESIDE = ("growth", "jobs")


class Bench(click.Group):
    """A group whose `work` may go without saying: `glshade bench W1`, `glshade bench --json`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args or args[0] not in (*self.commands, *ctx.help_option_names):
            args = ["work", *args]
        return super().parse_args(ctx, args)


@click.group(cls=Bench)
def command() -> None:
    """Measures what things cost on this driver, by the clock on the wall.

    `glshade bench` alone, or with names such as W1, is `glshade bench work`: the same pictures drawn by glshade and by other
    programs.
    """


@command.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--peers", multiple=True, metavar="NAME", help="Only this peer, and moderngl by hand; repeatable.")
@click.option("--repeat", type=click.IntRange(1, 1000), default=7, show_default=True, help="Rounds, each program once in each.")
@click.option("--size", type=click.Choice(["full", "small"]), default="full", help="small: in a moment, to see that it works.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout, for keeping.")
@click.option("--markdown", "as_markdown", is_flag=True, help="The tables of docs/benchmarks.md on stdout.")
@click.option(
    "--save", type=click.Path(path_type=Path, dir_okay=False), help="Keeps the JSON object in a file, whatever is shown."
)
def work(
    names: tuple[str, ...], peers: tuple[str, ...], repeat: int, size: str, as_json: bool, as_markdown: bool, save: Path | None
) -> None:
    """Times glshade beside other programs: each NAME, or all of them: W1 W2 W3 W3s W4 W5 growth jobs.

    A program written by hand with moderngl always takes part, and of pyrender, Mitsuba, VTK and Panda3D those that are
    installed (`pip install 'glshade[peers]'`). They work in turn, each in a process of its own; docs/benchmarks.md says how.
    """
    import json

    from glshade.bench.contest import contest
    from glshade.bench.growth import SERIES, growth
    from glshade.bench.jobs import jobs
    from glshade.bench.peers import installed
    from glshade.bench.report import Report, markdown
    from glshade.bench.works import BY_HAND, WORKS
    from glshade.cli import _table
    from glshade.files import replacing

    if as_json and as_markdown:
        raise click.UsageError("--json or --markdown?")
    wanted = _table.chosen(names, dict.fromkeys((*WORKS, *MEASURED_BESIDE)), "work")
    there = dict.fromkeys(installed())
    programs = list(dict.fromkeys((BY_HAND, *_table.chosen(peers, there, "installed peer"))))
    report, small = Report(repeat, size == "small"), size == "small"
    for name in dict.fromkeys(wanted):
        click.echo(f"{name} ...", err=True)
        if name == "growth":
            report.growths = [growth(what, repeat, small) for what in SERIES]
        elif name == "jobs":
            report.jobs = jobs(repeat, small)
        else:
            report.contests[name] = contest(WORKS[name].small() if small else WORKS[name], programs, repeat)
    if save is not None:
        with replacing(save) as beside:
            beside.write_text(json.dumps(report.as_dict(), indent=1) + "\n", encoding="utf-8")
    if as_json:
        _table.as_json(report.as_dict())
    elif as_markdown:
        click.echo(markdown(report), nl=False)
    else:
        _tell(report)


def _tell(report: Report) -> None:
    from glshade.cli import _table

    for line in report.heading():
        click.echo(line)
    for title, (heads, *rows) in report.tables():
        click.echo()
        _table.title(title)
        _table.table(heads, rows)


@command.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
@click.option("--repeat", type=click.IntRange(1, 1000), default=7, show_default=True, help="Measurements of each model.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout, for keeping.")
def brdfs(names: tuple[str, ...], backend: Any, device: int | None, repeat: int, as_json: bool) -> None:
    """What the models cost: each NAME, or all of them.

    For one evaluation, with the defaults and with each option: nanoseconds a pixel and a vertex, median and range; the
    operations it asks for, "-" where the driver does not show them; the bytes of its GLSL.
    """
    from glshade.bench.brdfs import costs, table
    from glshade.brdfs import BRDFS
    from glshade.cli import _table

    found = costs(_table.chosen(names, BRDFS, "model"), repeat, backend, device)
    if as_json:
        _table.as_json(found.as_dict())
        return
    click.echo(f"{found.renderer}; {found.version}")
    what = "of one core" if found.clock == "core" else "by the clock on the wall"
    click.echo(f"{found.threads} threads; nanoseconds {what} an evaluation, median and range of {repeat}")
    heads, *rows = table(found)
    _table.table(heads, rows)
