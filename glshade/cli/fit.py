"""Command `glshade fit`: finds the parameters of a model that come nearest to measured reflectance."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from glshade.cli._options import models


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-m", "--model", "name", required=True, metavar="MODEL", help="Model to fit, as `glshade brdfs` lists them.")
@click.option(
    "--metric",
    type=click.Choice(["log-cosine", "cosine"]),
    default="log-cosine",
    show_default=True,
    help="Error to make small: squared differences of log(1 + f cos), or of f cos.",
)
@click.option(
    "-p", "--parameter", "parameters", metavar="NAME=VALUE", multiple=True, help="Parameter or option to keep; repeatable."
)
@click.option(
    "--start",
    "starts",
    metavar="NAME=VALUE",
    multiple=True,
    help="Value from which a parameter starts, such as the weight of a part that is off by default; repeatable.",
)
@models
def command(
    file: Path, name: str, metric: Any, parameters: tuple[str, ...], starts: tuple[str, ...], models: tuple[str, ...]
) -> None:
    """Fits a model to a FILE of measured reflectance.

    FILE holds measurements as Cornell (.brdf), MERL (.binary) or ALTA (text) write them. Prints a material to paste into a
    scene. Below it, by the angle of the light, are the median relative errors of the material, of the best constant, and of the
    table that `brdf = "measured"` draws.

    \b
    Examples:
      glshade fit krylon_blue.brdf --model ward
      glshade fit gold.binary --model ggx -p metallic=1
      glshade fit paint.binary --model lafortune --start ks_2=0.1 --metric cosine
    """
    from pydantic import ValidationError

    from glshade.brdfs import BRDFS
    from glshade.catalogue.fitting import fit_model, thinned
    from glshade.cli._material import changes
    from glshade.document import nearest
    from glshade.measured.reading import read
    from glshade.measured.samples import points

    if name not in BRDFS:
        raise click.BadParameter(f"no model is named {name!r}{nearest(name, BRDFS)}", param_hint="'--model'")
    model = BRDFS[name]
    if not model.has_reference:
        raise click.BadParameter(f"{name} has only a GLSL file, and a fit needs its Python function", param_hint="'--model'")
    if model.tables:
        raise click.BadParameter(f"{name} is no formula with parameters, but a table of its own", param_hint="'--model'")
    fixed, start = changes(parameters, "'--parameter'"), changes(starts, "'--start'")
    for hint, table in (("'--parameter'", fixed), ("'--start'", start)):
        _check(model, table, hint)
    measurement = read(file)
    try:
        fit = fit_model(measurement, model, metric, fixed, start)
        constant = fit_model(measurement, BRDFS["lambert"], metric)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"][:1])
        raise click.UsageError(f"{place}: {first['msg']}") from None
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    _print_material(file, fit)
    _print_errors(file, measurement, thinned(points(measurement, 20_000)), fit, constant)


def _check(model: Any, table: Mapping[str, Any], hint: str) -> None:
    """Refuses names that are no parameters or options of a model. Errors: click.BadParameter."""
    from glshade.document import nearest

    names = {*model.parameters(), *model.choices()}
    for name in table:
        if name not in names:
            brdf = model.model_fields["brdf"].default
            raise click.BadParameter(f"{brdf} has no {name!r}{nearest(name, names)}", param_hint=hint)


def _print_material(file: Path, fit: Any) -> None:
    """Prints the material as a table of a scene file."""
    import json

    name = re.sub(r"[^A-Za-z0-9_-]+", "_", file.stem) or "fitted"
    click.echo(f"[materials.{name}]")
    click.echo(f'brdf = "{fit.material.brdf}"')
    model = type(fit.material)
    for key in (*model.choices(), *model.parameters()):
        value = getattr(fit.material, key)
        if value is None or (key in fit.held and value == model.model_fields[key].default):
            continue
        if isinstance(value, str):
            click.echo(f"{key} = {json.dumps(value)}")
        else:
            # What is below a millionth cannot be told from 0.
            numbers = [
                f"{number:.5g}" if abs(number) >= 1e-6 else "0" for number in (value if isinstance(value, tuple) else (value,))
            ]
            click.echo(f"{key} = [{', '.join(numbers)}]" if len(numbers) == 3 else f"{key} = {numbers[0]}")
    for reason in dict.fromkeys(fit.held.values()):
        names = ", ".join(key for key, why in fit.held.items() if why == reason)
        click.echo(f"# Not fitted: {names}; {reason}.")
    click.echo(f"# Root of the mean squared error: {fit.error:.4g}")


def _print_errors(file: Path, measurement: Any, samples: Any, fit: Any, constant: Any) -> None:
    """Prints the errors by the angle of the light."""
    from glshade.catalogue.fit_errors import errors_by_angle, of_material
    from glshade.cli import _table
    from glshade.errors import AssetError
    from glshade.measured.file import load

    compared = {fit.material.brdf: of_material(fit.material), "constant": of_material(constant.material)}
    # Where the file can be read but no table can be made of it, its surface has a grain.
    with suppress(AssetError):
        compared["table"] = load(file).at
    rows = errors_by_angle(samples, compared)
    click.echo("")
    _table.table(
        ("light from", "samples", *compared),
        [(f"{row.low} to {row.high} degrees", str(row.count), *(_percent(row.medians[n]) for n in compared)) for row in rows],
    )


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"
