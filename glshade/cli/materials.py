"""glshade materials: the presets that ship with glshade."""

from __future__ import annotations

from typing import Any

import click


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="One JSON list on stdout.")
def command(names: tuple[str, ...], as_json: bool) -> None:
    """Lists the presets that `material = "gold"` chooses from; with NAMEs, their tables, to paste and change.

    The swatch is what the material shows from straight above under a white sky.
    """
    from glshade.catalogue import listing
    from glshade.cli import _table
    from glshade.presets import PRESETS

    chosen = _table.chosen(names, PRESETS, "preset")
    found = [listing.preset(name) for name in chosen]
    if as_json:
        _table.as_json(found)
    elif names:
        presets = dict(zip(chosen, found, strict=True))
        _table.each(chosen, lambda name: _show(presets[name]))
    else:
        _table.table(
            ("preset", "swatch", "model", "what it looks like", "source"),
            [(one["name"], _swatch(one["swatch"]), one["brdf"], one["description"], one["source"]) for one in found],
        )


def _swatch(code: str) -> tuple[str, str]:
    """The code on its own colour, in black or white as it reads better."""
    luminance = sum(w * int(code[i : i + 2], 16) for w, i in ((0.2126, 1), (0.7152, 3), (0.0722, 5)))
    return code, f"{'black' if luminance > 127 else 'white'} on {code}"


def _show(preset: dict[str, Any]) -> None:
    import json

    from glshade.cli import _table

    _table.title(preset["name"], preset["description"])
    _table.paragraph(preset["source"], "source")
    text, style = _swatch(preset["swatch"])
    click.echo("swatch: " + click.style(text, bg=_rgb(text), fg=style.partition(" ")[0]))
    click.echo()
    click.echo(f"[materials.{preset['name']}]")
    for key, value in preset["material"].items():
        # What these tables hold reads alike in TOML and JSON.
        click.echo(f"{key} = {json.dumps(value)}")


def _rgb(code: str) -> tuple[int, int, int]:
    return int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16)
