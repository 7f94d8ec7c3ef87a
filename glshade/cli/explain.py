"""glshade explain: what a scene's programs hold, and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("--shading", type=click.Choice(["flat", "gouraud", "phong"]), help="As for `glshade render`.")
@click.option("--source", is_flag=True, help="Also the generated source of every program.")
def command(scene: Path, shading: Any, source: bool) -> None:
    """Prints the Plan of SCENE: each program, what it holds, and which object or light requires it."""
    from glshade.plan import explain
    from glshade.scene_file import load
    from glshade.source import generate

    plan = explain(load(scene), shading)
    click.echo(str(plan))
    if source:
        for index, program in enumerate(plan.programs):
            text = generate(program)
            click.echo(f"\n// program {index}, vertex stage\n{text.vertex.text}")
            assert text.fragment is not None
            click.echo(f"// program {index}, fragment stage\n{text.fragment.text}")
