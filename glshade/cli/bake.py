"""Command `glshade bake`: writes the values of a material as a file of measured reflectance."""

from __future__ import annotations

from pathlib import Path

import click

from glshade.cli._options import models


@click.command()
@click.argument("material")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="File to write, as .binary or .brdf.")
@click.option("-p", "--parameter", "parameters", metavar="NAME=VALUE", multiple=True, help="Replaces a parameter; repeatable.")
@models
def command(material: str, output: Path, parameters: tuple[str, ...], models: tuple[str, ...]) -> None:
    """Writes the values of a MATERIAL as measured reflectance.

    MATERIAL is a model, a preset or a material of a scene, as for `glshade plot`. A .binary file (MERL) holds isotropic
    materials, and the mean of f(l, v) and f(v, l) of models that are not reciprocal; a .brdf file (Cornell) holds any material.

    \b
    Examples:
      glshade bake ggx:roughness=0.4 -o ggx.binary
      glshade bake ward:alpha_x=0.3,alpha_y=0.1 -o brushed.brdf
    """
    from glshade.catalogue.baking import check_suffix, write
    from glshade.cli._material import materials as named

    check_suffix(output)
    found = named([material], parameters)
    if len(found) != 1:
        raise click.BadParameter(
            f"{material} names {len(found)} materials; name one of them: {', '.join(found)}", param_hint="'MATERIAL'"
        )
    ((label, chosen),) = found.items()
    if not type(chosen).has_reference:
        raise click.BadParameter(
            f"{chosen.brdf} has only a GLSL file, and baking needs its Python function", param_hint="'MATERIAL'"
        )
    write(chosen, output, f"glshade, {label}")
    if "reciprocity" in type(chosen).breaks and output.suffix.lower() == ".binary":
        click.echo(
            f"glshade: warning: {chosen.brdf} is not reciprocal; the file holds the mean of f(l, v) and f(v, l)", err=True
        )
    click.echo(str(output))
