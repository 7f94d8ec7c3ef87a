"""Command `glshade laws`: draws changed scenes whose pictures are known, and checks the pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from glshade.cli._options import Size, driver, filmed, limits, models, overrides, shaders
from glshade.limits import Limits


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("--only", multiple=True, metavar="NAME", help="Checks only this law. Repeatable.")
@driver
@shaders
@models
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@limits
@overrides
@click.option("--json", "as_json", is_flag=True, help="Prints the findings as JSON.")
def command(
    scene: Path,
    only: tuple[str, ...],
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    size: tuple[int, int] | None,
    overrides: list[tuple[str, str]],
    limits: Limits,
    as_json: bool,
) -> None:
    """Checks the laws of pictures on SCENE.

    A law is a change of the scene whose effect on the picture is known: a mirrored world, for example, gives the mirrored
    picture. Each changed scene is drawn by the float64 reference and by the GPU. The exit code is 0 if all laws hold that apply
    to the scene, and 6 if one is broken.
    """
    from glshade.document import nearest
    from glshade.gl.renderer import Renderer
    from glshade.scene.file import load
    from glshade.verification.laws import LAWS, check_laws

    for name in only:
        if name not in LAWS:
            raise click.BadParameter(f"no law is named {name!r}{nearest(name, LAWS)}", param_hint="'--only'")
    loaded = filmed(load(scene, overrides, limits=limits), {"size": size})
    with Renderer(backend, device, shaders=shaders) as renderer:
        findings = list(check_laws(loaded, only or LAWS, renderer=renderer))
    if as_json:
        from glshade.cli import _table

        _table.as_json([{**vars(finding), "outcome": finding.outcome} for finding in findings])
    else:
        _print(findings)
    raise SystemExit(6 if any(finding.broken for finding in findings) else 0)


def _print(findings: list[Any]) -> None:
    """Prints a table of findings, and a line for each law that does not apply."""
    from glshade.cli import _table

    heads = ("law", "drawn by", "pixels", "deviation", "allowance", "used", "outcome")
    _table.table(
        heads,
        [
            (
                finding.law,
                finding.drawn_by,
                str(finding.pixels),
                f"{finding.deviation:.1e}",
                f"{finding.allowance:.1e}",
                f"{finding.used:.0%}",
                (f"broken at {finding.broken} pixels", "red") if finding.broken else "holds",
            )
            for finding in findings
            if not finding.reason
        ],
    )
    for law, reason in {finding.law: finding.reason for finding in findings if finding.reason}.items():
        click.echo(f"{law} does not apply: {reason}")
