"""glshade explain: what a scene's programs hold, and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from glshade.cli.render import overrides


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("--shading", type=click.Choice(["flat", "gouraud", "phong"]), help="As for `glshade render`.")
@overrides
@click.option("--source", is_flag=True, help="Also the generated source of every program.")
@click.option(
    "--active", is_flag=True, help="Also the uniforms and attributes, and whether the driver finds all of them in use."
)
@click.option("--census", is_flag=True, help='Also the operations of every stage; "-" where the driver does not show them.')
@click.option("--json", "as_json", is_flag=True, help="All of it as one JSON object; null for what the driver does not say.")
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
def command(
    scene: Path,
    shading: Any,
    overrides: list[tuple[str, str]],
    source: bool,
    active: bool,
    census: bool,
    as_json: bool,
    backend: Any,
    device: int | None,
) -> None:
    """Prints the Plan of SCENE: each program, what it holds, and which object, light or setting requires it.

    Without --active, --census and --json no driver is needed.

    In the end, how many variants there might be. Nominal: every value of every knob with every other, for the scene's models
    and kinds of light, as many as a shader with a switch for each would have. Valid: those that a scene can ask for, since
    some knobs presuppose others. Written: the distinct programs of this scene with its materials as they are written.
    Canonical: with the simplest materials of the same value. Compiled: those whose text differs, as the driver gets them.
    """
    from glshade.glsl.explanation import explanation
    from glshade.scene.file import load

    found = explanation(load(scene, overrides), shading)
    if as_json:
        from glshade.cli import _table

        _table.as_json(_with_driver(found, True, True, backend, device, needed=False).as_dict())
        return
    found = _with_driver(found, active, census, backend, device, needed=True)
    for index, program in enumerate(found.programs):
        click.echo(f"program {index}: {program.plan}\n  draws {_few(program.draws)}")
        for feature, reason in program.features:
            click.echo(f"  {feature}: because of {reason}")
        if active:
            click.echo("\n".join(f"  {line}" for line in _interface(program)))
        if census:
            for stage in ("vertex", "fragment"):
                click.echo(f"  {stage} operations: {_operations(program.operations, stage)}")
    counts = found.variants.as_dict()
    click.echo("variants: " + ", ".join(f"{count:,} {name}" for name, count in counts.items()))
    if source:
        for index, program in enumerate(found.programs):
            for stage in ("vertex", "fragment"):
                click.echo(f"\n// program {index}, {stage} stage\n{getattr(program.source, stage).text}")


def _with_driver(found: Any, active: bool, census: bool, backend: Any, device: int | None, needed: bool) -> Any:
    """The explanation with what the driver is asked for. Errors: ContextError where there is none, and one is needed."""
    from glshade.errors import ContextError
    from glshade.glsl.explanation import with_active, with_operations

    if not (active or census):
        return found
    try:
        if active:
            from glshade.gl.context import open_context

            context = open_context(backend, device)
            try:
                found = with_active(found, context)
            finally:
                context.release()
        if census:
            found = with_operations(found, backend, device)
    except ContextError:
        if needed:
            raise
    return found


def _few(names: tuple[str, ...]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def _interface(program: Any) -> list[str]:
    """Uniforms, attributes and blocks, and what of them the driver drops."""
    lines = []
    for what, names in program.declared.as_dict().items():
        words = [f"{type} {name}" for name, type in names.items()] if isinstance(names, dict) else names
        lines += [f"{what}: {', '.join(words)}"] * bool(words)
    dropped = program.inactive
    if dropped:
        return [*lines, f"FAULT: declared, and not active in the driver: {', '.join(dropped)}"]
    return [*lines, "all of them active in the driver"]


def _operations(found: Any, stage: str) -> str:
    if not found or not found[stage]:
        return "-"
    counts = dict(found[stage])
    total = counts.pop("total")
    return f"{total} ({', '.join(f'{count} {name}' for name, count in counts.items() if count) or 'none'})"
