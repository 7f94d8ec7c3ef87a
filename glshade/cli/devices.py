"""glshade devices: what EGL offers."""

from __future__ import annotations

import click


@click.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON list on stdout.")
def command(as_json: bool) -> None:
    """Lists EGL's devices; the number is what --device takes."""
    import json
    from dataclasses import asdict

    from glshade.gl.context import devices

    found = devices()
    if as_json:
        click.echo(json.dumps([asdict(device) for device in found], indent=2))
        return
    for device in found:
        kind = "software" if device.is_software else "hardware"
        click.echo(f"{device.index}: {device.vendor}, EGL {device.version} ({kind})")
    if not found:
        click.echo("EGL lists no devices")
