"""glshade brdfs: the reflectance models, as they declare themselves."""

from __future__ import annotations

from typing import Any

import click


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="One JSON list of full declarations on stdout.")
def command(names: tuple[str, ...], as_json: bool) -> None:
    """Lists the reflectance models, one a line; with NAMEs, all that those declare.

    Parameters with default, range and unit; options; the laws that a model keeps or breaks; the simpler models it becomes.
    """
    from glshade.brdfs import BRDFS
    from glshade.catalogue import listing
    from glshade.cli import _table

    chosen = _table.chosen(names, BRDFS, "model")
    if as_json:
        _table.as_json([listing.brdf(name) for name in chosen])
    elif names:
        _table.each(chosen, lambda name: _show(listing.brdf(name)))
    else:
        _table.table(
            ("model", "what it is", "parameters", "breaks"),
            [
                (
                    model["name"],
                    model["summary"],
                    " ".join(item["name"] for item in [*model["parameters"], *model["options"]]),
                    ", ".join(law for law, kept in model["laws"].items() if not kept["promised"]) or "-",
                )
                for model in map(listing.brdf, chosen)
            ],
        )


def _show(model: dict[str, Any]) -> None:
    from glshade.brdfs import Brdf
    from glshade.catalogue import listing
    from glshade.cli import _table

    _table.title(model["name"], model["summary"])
    _table.paragraph(model["description"])
    _table.paragraph(model["source"], "source")
    click.echo()
    _table.table(
        ("parameter", "takes", "default", "range", "usual", "unit", "meaning"),
        [
            (
                item["name"] + (" *" if item["base"] else ""),
                item["type"],
                f"= {item['same_as']}" if item["default"] is None and item["same_as"] else _table.value(item["default"]),
                f"{item['low']:g} to {item['high']:g}" if item["high"] is not None else f"from {item['low']:g}",
                f"{item['usual'][0]:g} to {item['usual'][1]:g}",
                item["unit"],
                item["description"],
            )
            for item in model["parameters"]
        ],
    )
    if any(item["base"] for item in model["parameters"]):
        click.echo("* the surface's own colour: vertex colours multiply it, its texture carries alpha")
    if model["options"]:
        click.echo()
        _table.table(
            ("option", "default", "choices", "meaning"),
            [(item["name"], item["default"], ", ".join(item["choices"]), item["description"]) for item in model["options"]],
        )
    click.echo()
    for law, kept in model["laws"].items():
        _table.paragraph(
            f"kept: {listing.LAWS[law]}" if kept["promised"] else f"broken: {kept['reason']}",
            law,
        )
    if model["shares"] and model["laws"]["energy"]["promised"]:
        _table.paragraph(f"promised where {' + '.join(model['shares'])} is at most 1", "energy's budget")
    if model["anisotropic"]:
        where = ", ".join(f"{name} = {_table.value(value)}" for name, value in model["isotropic_where"].items())
        _table.paragraph(
            f"it looks at the tangent; isotropic where {where}" if where else "it looks at the tangent", "anisotropic"
        )
    for limit in model["limits"]:
        _table.paragraph(limit["says"], "limit")
    # The class has no parameters of its own: these are what every material may say of its surface.
    _table.paragraph(", ".join(name for name in Brdf.model_fields if name != "brdf"), "also, as every material")
