"""Command `glshade materials`: lists the presets that ship with glshade."""

from __future__ import annotations

from typing import Any

import click

from glshade.cli._options import models


@click.command()
@models
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="Prints one JSON list.")
def command(names: tuple[str, ...], as_json: bool, models: tuple[str, ...]) -> None:
    """Lists the presets of materials.

    A scene names a preset as in `material = "gold"`. With names, prints the table of each NAME, for a scene file. The swatch
    is the colour of the material, seen at a right angle under a white sky.
    """
    from glshade.catalogue import listing
    from glshade.cli import _table
    from glshade.presets import PRESETS

    chosen = _table.chosen(names, PRESETS, "preset")
    described = [listing.preset(name) for name in chosen]
    if as_json:
        _table.as_json(described)
    elif names:
        presets = dict(zip(chosen, described, strict=True))
        _table.each(chosen, lambda name: _show(presets[name]))
    else:
        _table.table(
            ("preset", "swatch", "model", "what it looks like", "source"),
            [(item["name"], _swatch(item["swatch"]), item["brdf"], item["description"], item["source"]) for item in described],
        )


def _swatch(code: str) -> tuple[str, str]:
    """Returns a table cell whose background is the colour and whose text is its code, in black or white for best contrast."""
    luminance = sum(w * int(code[i : i + 2], 16) for w, i in ((0.2126, 1), (0.7152, 3), (0.0722, 5)))
    return code, f"{'black' if luminance > 127 else 'white'} on {code}"


def _show(preset: dict[str, Any]) -> None:
    """Prints a preset as a table for a scene file. preset: its description, as `listing.preset` returns it."""
    import json

    from glshade.cli import _table

    _table.title(preset["name"], preset["description"])
    _table.paragraph(preset["source"], "source")
    text, style = _swatch(preset["swatch"])
    click.echo("swatch: " + click.style(text, bg=_rgb(text), fg=style.partition(" ")[0]))
    click.echo()
    click.echo(f"[materials.{preset['name']}]")
    for key, value in preset["material"].items():
        # The values of a preset are written alike in JSON and in TOML.
        click.echo(f"{key} = {json.dumps(value)}")


def _rgb(code: str) -> tuple[int, int, int]:
    """Returns the codes from 0 to 255 of a colour such as #ffd700."""
    return int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16)
