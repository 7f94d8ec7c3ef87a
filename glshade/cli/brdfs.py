"""Command `glshade brdfs`: lists the reflectance models with their declarations."""

from __future__ import annotations

from typing import Any

import click

from glshade.cli._options import models


@click.command()
@models
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="Prints full declarations as one JSON list.")
def command(names: tuple[str, ...], as_json: bool, models: tuple[str, ...]) -> None:
    """Lists the reflectance models.

    With names, prints the declaration of each NAME: its parameters with default, range and unit, its options, the laws that it
    keeps or breaks, and the simpler models that it equals in a limit.
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
                    _broken(model),
                )
                for model in map(listing.brdf, chosen)
            ],
        )


def _broken(model: dict[str, Any]) -> str:
    """Returns the names of the laws that a model breaks, "-" for none, or "no reference" where they are unknown."""
    if not model["reference"]:
        return "no reference"
    return ", ".join(law for law, kept in model["laws"].items() if not kept["promised"]) or "-"


def _show(model: dict[str, Any]) -> None:
    """Prints the full declaration of a model. model: its description, as `listing.brdf` returns it."""
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
    if model["keys"]:
        click.echo()
        _table.table(
            ("key", "takes", "default", "meaning"),
            [(item["name"], item["takes"], _table.value(item["default"]), item["description"]) for item in model["keys"]],
        )
    click.echo()
    if not model["reference"]:
        _table.paragraph(
            "none: the model has only a GLSL file, so its pictures are verified against that file, and its laws are not known",
            "reference",
        )
    for law, kept in model["laws"].items() if model["reference"] else ():
        _table.paragraph(
            f"kept: {listing.LAWS[law]}" if kept["promised"] else f"broken: {kept['reason']}",
            law,
        )
    if model["shares"] and model["laws"]["energy"]["promised"]:
        _table.paragraph(f"kept where {' + '.join(model['shares'])} is at most 1", "energy budget")
    if model["anisotropic"]:
        where = ", ".join(f"{name} = {_table.value(value)}" for name, value in model["isotropic_where"].items())
        _table.paragraph(
            f"depends on the tangent; isotropic where {where}" if where else "depends on the tangent", "anisotropic"
        )
    for limit in model["limits"]:
        _table.paragraph(limit["says"], "limit")
    # The base class has no parameters, so its fields are the keys of the surface, which every material has.
    _table.paragraph(", ".join(name for name in Brdf.model_fields if name != "brdf"), "keys of every material")
