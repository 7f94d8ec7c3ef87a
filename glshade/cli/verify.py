"""Command `glshade verify`: draws a picture and compares it with the float64 reference."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import Size, driver, filmed, limits, models, overrides, point_size, shaders
from glshade.limits import Limits

if TYPE_CHECKING:
    from glshade.scene.scene import Scene


@click.command()
@click.argument("scene", type=click.Path(path_type=Path), required=False)
@driver
@shaders
@models
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@point_size
@click.option(
    "--shading",
    type=click.Choice(["flat", "gouraud", "phong"]),
    help="Shading per face, per vertex or per pixel, for the whole picture.",
)
@limits
@overrides
@click.option(
    "--report", type=click.Path(path_type=Path, file_okay=False), help="Writes a page with the evidence to this folder."
)
@click.option(
    "--derived",
    is_flag=True,
    help="Compares with the GLSL itself, run in float64 on the CPU, and not with the models' Python functions.",
)
@click.option("--json", "as_json", is_flag=True, help="Prints the verdict as JSON.")
@click.option(
    "--max-ambiguous",
    type=click.FloatRange(0, 100),
    default=3.0,
    show_default=True,
    help="Largest share of pixels that may be ambiguous, such as outlines and equal depths [percent].",
)
@click.option(
    "--mutate", metavar="all|NAME", help="Instead, plants faults in the programs and checks that verify notices each."
)
@click.option(
    "--table",
    is_flag=True,
    help="Instead, prints the errors of every model at every shading rate under every light. Takes no SCENE.",
)
def command(
    scene: Path | None,
    backend: Any,
    device: int | None,
    size: tuple[int, int] | None,
    point_size: float | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    shading: Any,
    overrides: list[tuple[str, str]],
    limits: Limits,
    report: Path | None,
    derived: bool,
    as_json: bool,
    max_ambiguous: float,
    mutate: str | None,
    table: bool,
) -> None:
    """Verifies a picture of SCENE.

    Draws SCENE in linear values with the samples of its film, and compares every pixel with the float64 reference.
    The exit code is 0 if the picture is verified, 6 if it is wrong, and 7 if too many pixels are ambiguous to decide.
    """
    if table:
        _table(backend, device, shaders, as_json)
        return
    if scene is None:
        raise click.UsageError("Missing argument 'SCENE'.")
    from glshade.scene.file import load

    loaded = filmed(load(scene, overrides, limits=limits), {"size": size, "point_size": point_size})
    if mutate is not None:
        _mutate(loaded, mutate, backend, device, shaders, shading, derived, as_json)
        return
    from glshade.verification.verification import verify

    verdict = verify(
        loaded,
        backend=backend,
        device=device,
        shaders=shaders,
        shading=shading,
        max_ambiguous=max_ambiguous / 100,
        derived=derived,
    )
    page = verdict.report(report, scene.name) if report is not None else None
    if as_json:
        import json

        click.echo(json.dumps(verdict.as_dict(), indent=2))
    else:
        click.echo(f"{scene}: {verdict}")
        if page is not None:
            click.echo(f"report: {page}")
    raise SystemExit(verdict.exit_code)


def _mutate(
    scene: Scene,
    name: str,
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    shading: Any,
    derived: bool,
    as_json: bool,
) -> None:
    """Plants faults, one mutation at a time, and prints for each whether verify notices it.

    name: name of a mutation, or "all"
    Errors: SystemExit 6 if verify misses a fault that changes the picture visibly.
    """
    from glshade.document import nearest
    from glshade.gl.renderer import Renderer
    from glshade.verification.mutations import MUTATIONS
    from glshade.verification.trials import try_mutations

    if name != "all" and name not in MUTATIONS:
        raise click.BadParameter(f"no mutation is named {name!r}{nearest(name, MUTATIONS)}", param_hint="'--mutate'")
    with Renderer(backend, device, shaders=shaders) as renderer:
        trials = try_mutations(
            scene, MUTATIONS if name == "all" else [name], renderer=renderer, shading=shading, derived=derived
        )
    survived = [trial for trial in trials if trial.shows and not trial.caught]
    if as_json:
        import json

        rows = [{"mutation": t.mutation.name, "change": t.change, "shows": t.shows, "caught": t.caught} for t in trials]
        click.echo(json.dumps(rows, indent=2))
    else:
        for trial in trials:
            if trial.change == 0:
                outcome = "does not change this picture"
            else:
                pixels = trial.verdict.unexplained if trial.verdict else 0
                missed = "NOT CAUGHT" if trial.shows else "too small to be visible"
                outcome = f"caught, {pixels} pixels" if trial.caught else missed
                outcome += f", changes the picture by {trial.change:.1e}" if trial.change >= 0 else ""
            click.echo(f"{trial.mutation.name:22} {outcome}")
    raise SystemExit(6 if survived else 0)


def _table(backend: Any, device: int | None, shaders: tuple[str, ...], as_json: bool) -> None:
    """Prints the errors of every model at every shading rate under every light."""
    from glshade.gl.renderer import Renderer
    from glshade.verification.survey import survey_models

    with Renderer(backend, device, shaders=shaders) as renderer:
        if as_json:
            import json

            click.echo(json.dumps([vars(row) for row in survey_models(renderer)], indent=2))
            return
        click.echo(f"{renderer.context.renderer}; {renderer.context.version}")
        click.echo(
            f"{'model':20}{'rate':9}{'light':20}{'worst':>9}{'p99.9':>9}{'tolerance':>11}{'used':>6}{'ambiguous':>11}  verdict"
        )
        for row in survey_models(renderer):
            click.echo(
                f"{row.model:20}{row.rate:9}{row.light:20}{row.worst:9.1e}{row.p999:9.1e}{row.tolerance:11.1e}"
                f"{row.used:6.0%}{row.ambiguous:11.2%}  {row.verdict}"
            )
