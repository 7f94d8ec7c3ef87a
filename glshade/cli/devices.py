"""Command `glshade devices`: lists the devices of EGL."""

from __future__ import annotations

import click


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Prints one JSON list.")
def command(as_json: bool) -> None:
    """Lists the devices of EGL. Their numbers are the values of --device."""
    import json
    from dataclasses import asdict

    from glshade.gl.context import devices

    listed = devices()
    if as_json:
        click.echo(json.dumps([asdict(device) for device in listed], indent=2))
        return
    for device in listed:
        kind = "software" if device.is_software else "hardware"
        click.echo(f"{device.index}: {device.vendor}, EGL {device.version} ({kind})")
    if not listed:
        click.echo("EGL lists no devices")
