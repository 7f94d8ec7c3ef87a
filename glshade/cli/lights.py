"""glshade lights: the lights, as they declare themselves."""

from __future__ import annotations

from typing import Any

import click


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="One JSON list of full declarations on stdout.")
def command(names: tuple[str, ...], as_json: bool) -> None:
    """Lists the lights, one a line; with NAMEs, all that those declare: keys, falloffs, and the GLSL struct."""
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
        _table.paragraph("from everywhere: it adds the ambient reflectance times its intensity", "direction")
    _table.paragraph(", ".join(f"{kind} {name}" for name, kind in light["uniforms"].items()), "GLSL struct")
