"""glshade bench: what things cost on the driver at hand. One subcommand a function of this module."""

from __future__ import annotations

from typing import Any

import click


@click.group()
def command() -> None:
    """Measures what things cost on this driver, by the clock on the wall."""


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
