"""Command `glshade explain`: prints the features of a scene's programs, and the reason for each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from glshade.cli._options import driver, limits, models, overrides, shaders
from glshade.limits import Limits


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option(
    "--shading",
    type=click.Choice(["flat", "gouraud", "phong"]),
    help="Shading per face, per vertex or per pixel, for the whole picture.",
)
@limits
@overrides
@click.option("--source", is_flag=True, help="Also prints the generated source of every program.")
@click.option(
    "--active",
    is_flag=True,
    help="Also prints the uniforms and attributes, and whether the driver reports all of them as active.",
)
@click.option(
    "--census", is_flag=True, help='Also prints the operations of every stage, or "-" if the driver does not show them.'
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Prints everything as one JSON object, with null for facts that the driver does not report.",
)
@driver
@shaders
@models
def command(
    scene: Path,
    shading: Any,
    overrides: list[tuple[str, str]],
    limits: Limits,
    source: bool,
    active: bool,
    census: bool,
    as_json: bool,
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
) -> None:
    """Explains the programs of SCENE.

    Prints each program, its features, and the object, light or setting that requires each feature. No driver is
    needed without --active, --census and --json.

    The last line counts shader variants. Nominal: all combinations of all settings, for the scene's models and kinds of light,
    as a shader with a switch for each setting would have. Valid: the combinations that a scene can ask for, since some
    settings require others. Written: the distinct programs of this scene with its materials as they are written. Canonical:
    the same with each material replaced by the simplest one of equal value. Compiled: the programs whose text differs.
    """
    from glshade.glsl.explanation import explanation_of
    from glshade.glsl.shaders import current
    from glshade.scene.file import load

    explanation = explanation_of(load(scene, overrides, limits=limits), shading, current(shaders))
    if as_json:
        from glshade.cli import _table

        _table.as_json(_with_driver(explanation, True, True, backend, device, needed=False).as_dict())
        return
    explanation = _with_driver(explanation, active, census, backend, device, needed=True)
    for index, program in enumerate(explanation.programs):
        click.echo(f"program {index}: {program.plan}\n  draws {_few(program.draws)}")
        for feature, reason in program.features:
            click.echo(f"  {feature}: because of {reason}")
        if active:
            click.echo("\n".join(f"  {line}" for line in _interface(program)))
        if census:
            for stage in ("vertex", "fragment"):
                click.echo(f"  {stage} operations: {_operations(program.operations, stage)}")
    counts = explanation.variants.as_dict()
    click.echo("variants: " + ", ".join(f"{count:,} {name}" for name, count in counts.items()))
    if source:
        for index, program in enumerate(explanation.programs):
            for stage in ("vertex", "fragment"):
                click.echo(f"\n// program {index}, {stage} stage\n{getattr(program.source, stage).text}")


def _with_driver(explanation: Any, active: bool, census: bool, backend: Any, device: int | None, needed: bool) -> Any:
    """Returns the explanation, completed with facts that only a driver knows.

    explanation: the explanation without a driver
    active: True asks for the active uniforms and attributes
    census: True asks for the operations
    backend: OpenGL backend, as for Renderer
    device: EGL device; None leaves the choice to the driver
    needed: False returns the explanation unchanged if there is no driver
    Errors: ContextError if there is no driver and one is needed.
    """
    if not (active or census):
        return explanation
    from glshade.errors import ContextError

    try:
        if active:
            from glshade.gl.activity import with_active
            from glshade.gl.context import open_context

            context = open_context(backend, device)
            try:
                explanation = with_active(explanation, context)
            finally:
                context.release()
        if census:
            from glshade.driver.census import with_operations

            explanation = with_operations(explanation, backend, device)
    except ContextError:
        if needed:
            raise
    return explanation


def _few(names: tuple[str, ...]) -> str:
    """Returns up to five names, and the number of the others."""
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def _interface(program: Any) -> list[str]:
    """Returns lines that list a program's uniforms, attributes and blocks, and which of them are not active in the driver."""
    lines = []
    for what, names in program.declared.as_dict().items():
        words = [f"{type} {name}" for name, type in names.items()] if isinstance(names, dict) else names
        if words:
            lines.append(f"{what}: {', '.join(words)}")
    if program.inactive:
        return [*lines, f"FAULT: declared, but not active in the driver: {', '.join(program.inactive)}"]
    return [*lines, "all of them active in the driver"]


def _operations(operations: Any, stage: str) -> str:
    """Returns the operations of a stage as text, or "-" if they are unknown."""
    if not operations or not operations[stage]:
        return "-"
    counts = dict(operations[stage])
    total = counts.pop("total")
    return f"{total} ({', '.join(f'{count} {name}' for name, count in counts.items() if count) or 'none'})"
