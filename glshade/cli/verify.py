"""glshade verify: a picture, and the proof that it is right."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli.render import Size, filmed, overrides

if TYPE_CHECKING:
    from glshade.scene.scene import Scene


@click.command()
@click.argument("scene", type=click.Path(path_type=Path), required=False)
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@click.option(
    "--shading",
    type=click.Choice(["flat", "gouraud", "phong"]),
    help="Per face, per vertex or per pixel, for the whole picture.",
)
@overrides
@click.option("--report", type=click.Path(path_type=Path, file_okay=False), help="Folder for a page with all the evidence.")
@click.option("--json", "as_json", is_flag=True, help="The verdict as JSON.")
@click.option(
    "--max-ambiguous",
    type=click.FloatRange(0, 100),
    default=3.0,
    show_default=True,
    help="Share of the picture that may be ambiguous (outlines, equal depths) [percent].",
)
@click.option("--mutate", metavar="all|NAME", help="Instead: puts faults into the programs, and says whether they are found.")
@click.option(
    "--table", is_flag=True, help="Instead: the errors of every model at every rate under every light. Needs no SCENE."
)
def command(
    scene: Path | None,
    backend: Any,
    device: int | None,
    size: tuple[int, int] | None,
    shading: Any,
    overrides: list[tuple[str, str]],
    report: Path | None,
    as_json: bool,
    max_ambiguous: float,
    mutate: str | None,
    table: bool,
) -> None:
    """Draws SCENE, linear and with one sample a pixel, and judges every pixel against the float64 reference.

    Exit code 0: verified; 6: failed; 7: inconclusive, since too much of the picture is ambiguous.
    """
    if table:
        _table(backend, device, as_json)
        return
    if scene is None:
        raise click.UsageError("Missing argument 'SCENE'.")
    from glshade.scene.file import load

    loaded = filmed(load(scene, overrides), {"size": size})
    if mutate is not None:
        _mutate(loaded, mutate, backend, device, shading, as_json)
        return
    from glshade.verification.verification import verify

    verdict = verify(loaded, backend=backend, device=device, shading=shading, max_ambiguous=max_ambiguous / 100)
    page = verdict.report(report, scene.name) if report is not None else None
    if as_json:
        import json

        click.echo(json.dumps(verdict.as_dict(), indent=2))
    else:
        click.echo(f"{scene}: {verdict}")
        if page is not None:
            click.echo(f"report: {page}")
    raise SystemExit(verdict.exit_code)


def _mutate(scene: Scene, name: str, backend: Any, device: int | None, shading: Any, as_json: bool) -> None:
    from glshade.document import nearest
    from glshade.verification.mutations import MUTATIONS, MutatedRenderer, trials

    if name != "all" and name not in MUTATIONS:
        raise click.BadParameter(f"no mutation is named {name!r}{nearest(name, MUTATIONS)}", param_hint="'--mutate'")
    with MutatedRenderer(backend, device) as renderer:
        found = trials(scene, None if name == "all" else [name], renderer=renderer, shading=shading)
    survived = [trial for trial in found if trial.shows and not trial.caught]
    if as_json:
        import json

        rows = [{"mutation": t.mutation.name, "change": t.change, "shows": t.shows, "caught": t.caught} for t in found]
        click.echo(json.dumps(rows, indent=2))
    else:
        for trial in found:
            if trial.change == 0:
                outcome = "changes nothing here"
            else:
                pixels = trial.verdict.unexplained if trial.verdict else 0
                outcome = f"caught, {pixels} pixels" if trial.caught else "NOT CAUGHT" if trial.shows else "too little to show"
                outcome += f", changes the picture by {trial.change:.1e}" if trial.change >= 0 else ""
            click.echo(f"{trial.mutation.name:22} {outcome}")
    raise SystemExit(6 if survived else 0)


def _table(backend: Any, device: int | None, as_json: bool) -> None:
    from glshade.gl.renderer import Renderer
    from glshade.verification.survey import survey

    with Renderer(backend, device) as renderer:
        if as_json:
            import json

            click.echo(json.dumps([vars(row) for row in survey(renderer)], indent=2))
            return
        click.echo(f"{renderer.context.renderer}; {renderer.context.version}")
        click.echo(
            f"{'model':20}{'rate':9}{'light':20}{'worst':>9}{'p99.9':>9}{'tolerance':>11}{'used':>6}{'ambiguous':>11}  verdict"
        )
        for row in survey(renderer):
            click.echo(
                f"{row.model:20}{row.rate:9}{row.light:20}{row.worst:9.1e}{row.p999:9.1e}{row.tolerance:11.1e}"
                f"{row.used:6.0%}{row.ambiguous:11.2%}  {row.verdict}"
            )
