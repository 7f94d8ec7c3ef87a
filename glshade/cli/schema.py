"""Command `glshade schema`: prints the JSON schema of scene files."""

from __future__ import annotations

import click

from glshade.cli._options import models


@click.command()
@models
def command(models: tuple[str, ...]) -> None:
    """Prints the JSON schema of scene files, for editors and validators."""
    import json

    from glshade.scene.scene import Scene

    click.echo(json.dumps(Scene.model_json_schema(), indent=2))
