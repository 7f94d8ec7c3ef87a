"""glshade schema: the scene file's JSON schema."""

from __future__ import annotations

import click


@click.command()
def command() -> None:
    """Prints the JSON schema of scene files, for editors and validators."""
    import json

    from glshade.scene.scene import Scene

    click.echo(json.dumps(Scene.model_json_schema(), indent=2))
