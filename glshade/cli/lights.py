"""Command `glshade lights`: lists the lights with their declarations."""

from __future__ import annotations

from typing import Any

import click

from glshade.cli._options import models


@click.command()
@models
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="Prints full declarations as one JSON list.")
def command(names: tuple[str, ...], as_json: bool, models: tuple[str, ...]) -> None:
    """Lists the lights.

    With names, prints the declaration of each NAME: its keys, falloffs and GLSL struct.
    """
    from glshade.catalogue import listing
    from glshade.cli import _table
    from glshade.lights import LIGHTS

    chosen = _table.chosen(names, LIGHTS, "light")
    if as_json:
        _table.as_json([listing.light(name) for name in chosen])
    elif names:
        _table.each(chosen, lambda name: _show(listing.light(name)))
    else:
        _table.table(
            ("light", "what it is", "keys", "falloffs"),
            [
                (
                    light["name"],
                    light["summary"],
                    " ".join(key["name"] for key in light["keys"]),
                    " ".join(light["falloffs"]) or "-",
                )
                for light in map(listing.light, chosen)
            ],
        )


def _show(light: dict[str, Any]) -> None:
    """Prints the full declaration of a light. light: its description, as `listing.light` returns it."""
    from glshade.cli import _table

    _table.title(light["name"], light["summary"])
    _table.paragraph(light["description"])
    click.echo()
    _table.table(
        ("key", "takes", "default", "meaning"),
        [
            (key["name"], key["takes"], "required" if key["required"] else _table.value(key["default"]), key["description"])
            for key in light["keys"]
        ],
    )
    click.echo()
    if light["falloffs"]:
        _table.paragraph(", ".join(light["falloffs"]), "falloffs")
    if light["omnidirectional"]:
        _table.paragraph(
            "from all around: a surface reflects the light for its normal times the model's ambient reflectance", "direction"
        )
    _table.paragraph(", ".join(f"{kind} {name}" for name, kind in light["uniforms"].items()), "GLSL struct")
