"""Command `glshade digits`: finds the lines of GLSL that lose digits in float32."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshade.cli._options import Size, filmed, models, overrides, shaders
from glshade.errors import printable
from glshade.github import annotation, path_in_repository

if TYPE_CHECKING:
    from glshade.spirv.digits import Digits, LineLoss

# The suffixes of shader files and of scene files.
SHADERS, SCENES = {".glsl"}, {".toml", ".json"}
# A map of lost digits has colours for steps of this many digits, which random errors do not blur, from none to MOST.
STEP, MOST = 0.5, 7.0
# The exit code where a line loses more than --limit.
LOST = 6


@click.command()
@click.argument("subject")
@shaders
@models
@overrides
@click.option("--size", type=Size(), help="Overrides the size of a scene's film [pixels].")
@click.option(
    "--count",
    type=click.IntRange(16, 1 << 20),
    default=8192,
    show_default=True,
    help="Number of random directions and parameters, or of a scene's pixels, at which the GLSL is run.",
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the random numbers.")
@click.option(
    "--limit",
    type=click.FloatRange(0),
    metavar="LOSS",
    help="The exit code is 6 if a line that is to blame loses more than LOSS of the result, such as 1e-4.",
)
@click.option(
    "--map",
    "heat",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Writes a map of a scene's lost digits: dark for none, pale yellow for all seven.",
)
@click.option("--json", "as_json", is_flag=True, help="Prints the lines as one JSON object.")
@click.option("--github", is_flag=True, help="Prints the lines as annotations of a GitHub workflow.")
def command(
    subject: str,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    overrides: list[tuple[str, str]],
    size: tuple[int, int] | None,
    count: int,
    seed: int,
    limit: float | None,
    heat: Path | None,
    as_json: bool,
    github: bool,
) -> None:
    """Finds the lines of SUBJECT's GLSL that lose digits in float32.

    SUBJECT is a model (ggx), a material (gold, ggx:roughness=0.01, scene.toml:name), a GLSL file of a model, or a scene. Its
    GLSL is run in float64, without a GPU. Then the operations of one line at a time are rounded as float32 rounds them: what
    that changes is the line's loss. A line is not to blame where rounding the inputs alone changes about as much (the question
    is ill-posed), or where the line only has the error that OpenGL allows a built-in function such as sqrt().
    """
    from glshade.scene.models import use_models

    use_models(models)
    is_scene = Path(subject).suffix.lower() in SCENES
    if not is_scene and (heat is not None or size is not None or overrides):
        raise click.UsageError("--map, --size and --set need a scene, and SUBJECT is none")
    if is_scene:
        digits = _of_scene(subject, shaders, overrides, size, count, seed, heat)
    else:
        digits = _of_model(subject, shaders, count, seed)
    if as_json:
        from glshade.cli import _table

        _table.as_json(as_dict(subject, digits))
    elif github:
        for loss in digits.bad:
            click.echo(_annotation(loss))
    else:
        _print(subject, digits)
    raise SystemExit(LOST if limit is not None and any(loss.loss > limit for loss in digits.bad) else 0)


def _of_scene(
    subject: str,
    folders: tuple[str, ...],
    overrides: list[tuple[str, str]],
    size: tuple[int, int] | None,
    count: int,
    seed: int,
    heat: Path | None,
) -> Digits:
    """Returns the digits that a scene loses, and writes its map. Errors: SceneError, ShaderError, MissingLibrary."""
    from glshade.catalogue.digits import digits_of_scene, errors_of_scene
    from glshade.glsl.shaders import current
    from glshade.scene.file import load

    scene = filmed(load(Path(subject), overrides), {"size": size})
    shaders = current(folders)
    if heat is not None:
        _write_map(heat, errors_of_scene(scene, seed, shaders))
    return digits_of_scene(scene, count, seed, shaders)


def _of_model(subject: str, folders: tuple[str, ...], count: int, seed: int) -> Digits:
    """Returns the digits that a model or a material loses.

    Errors: click.UsageError, SceneError, ShaderError, MissingLibrary.
    """
    from glshade.brdfs import BRDFS
    from glshade.catalogue.digits import digits_of_material, digits_of_model
    from glshade.cli._material import materials
    from glshade.glsl.shaders import current
    from glshade.spirv.digits import joined

    path = Path(subject)
    model = _model_of_file(path) if path.suffix.lower() in SHADERS else BRDFS.get(subject)
    # A model's file is found by shaders that are looked up after the model is known.
    shaders = current(folders)
    if model is not None:
        return digits_of_model(model, count, seed, shaders)
    return joined(digits_of_material(material, count, seed, shaders) for material in materials([subject]).values())


def _model_of_file(path: Path) -> Any:
    """Returns the model of a GLSL file; the folder of the file becomes a folder of models where the model is not known yet.

    Errors: click.BadParameter for a file that holds no model; SceneError, ShaderError.
    """
    from glshade.brdfs import BRDFS
    from glshade.scene.models import use_models

    if not path.is_file():
        raise click.BadParameter(f"{path} does not exist", param_hint="'SUBJECT'")
    if path.stem not in BRDFS:
        use_models(path.parent)
    if path.stem not in BRDFS:
        raise click.BadParameter(f"{path}: defines no model, which is a struct and brdf_cos()", param_hint="'SUBJECT'")
    return BRDFS[path.stem]


def _write_map(path: Path, errors: Any) -> None:
    """Writes a map of lost digits (H, W): colours for an 8-bit format, relative errors for a format with floats."""
    import numpy as np

    from glshade.image import file as picture_file
    from glshade.image.image import Image
    from glshade.page.ramp import colours
    from glshade.spirv.digits import digits_lost

    if picture_file.format_of(path).floats:
        Image(np.repeat(errors[..., None], 3, axis=2).astype(np.float32)).save(path)
    else:
        shown = np.round(digits_lost(errors) / STEP) * STEP
        Image(colours(shown.clip(0, MOST) / MOST), "srgb").save(path)


def as_dict(subject: str, digits: Digits) -> dict[str, Any]:
    """Returns the digits of a subject as values for JSON."""
    return {
        "subject": subject,
        "error": float(digits.errors.max(initial=0.0)),
        "error_of_rounded_inputs": float(digits.inputs.max(initial=0.0)),
        "lines": [
            {
                "place": loss.place,
                "text": loss.text,
                "loss": loss.loss,
                "digits": loss.digits,
                "loss_of_rounded_inputs": loss.inputs,
                "ill_posed": loss.ill_posed,
                "built_in": loss.built_in,
                "to_blame": loss.to_blame,
                "at": {name.partition("_")[2]: value for name, value in loss.at.items()},
                "value": list(loss.value),
            }
            for loss in digits.lines
        ],
    }


def _print(subject: str, digits: Digits) -> None:
    """Prints the lines that lose more than MENTIONED as a table, the inputs of the worst one, and a summary."""
    from glshade.cli import _table
    from glshade.spirv.digits import MENTIONED

    mentioned = [loss for loss in digits.lines if loss.loss > MENTIONED]
    if mentioned:
        heads = ("line", "loses", "digits", "rounded inputs", "", "text")
        _table.table(heads, [_row(loss) for loss in mentioned])
        click.echo()
    for loss in digits.bad[:1]:
        at = ", ".join(f"{name.partition('_')[2]} {_value(value)}" for name, value in loss.at.items())
        click.echo(f"{_short(loss.place)} is worst at {at}, where the exact result is {_value(list(loss.value))}.")
    bad = len(digits.bad)
    lines = "no line is" if not bad else f"{bad} {'line is' if bad == 1 else 'lines are'}"
    together, inputs = (float(errors.max(initial=0.0)) for errors in (digits.errors, digits.inputs))
    click.echo(
        f"{subject}: {lines} to blame for a loss of more than {MENTIONED:g}; all lines together lose {together:.1e}, and "
        f"rounding the inputs loses {inputs:.1e}"
    )


def _row(loss: LineLoss) -> tuple[str, str, str, str, str, str]:
    """Returns the cells of a line in the table."""
    blame = "ill-posed" if loss.ill_posed else "" if loss.to_blame else "built-in"
    return _short(loss.place), f"{loss.loss:.1e}", f"{loss.digits:.1f}", f"{loss.inputs:.1e}", blame, printable(loss.text)


def _short(place: str) -> str:
    """Returns a place with a path that is relative to the current folder where the file lies below it."""
    file, _, line = place.rpartition(":")
    return f"{path_in_repository(file) if os.path.isabs(file) else file}:{line}"


def _value(value: Any) -> str:
    """Returns a number, or a list of numbers, as a short text."""
    return f"({', '.join(map(_value, value))})" if isinstance(value, list) else f"{value:.6g}"


def _annotation(loss: LineLoss) -> str:
    """Returns a line as an annotation of a GitHub workflow. A line that is generated stands in no file."""
    file, _, line = _short(loss.place).rpartition(":")
    message = f"rounding in this line loses {loss.loss:.1e} of the result, {loss.digits:.1f} digits"
    if file.startswith("<"):
        return annotation("warning", f"{loss.place}: {message}")
    return annotation("warning", message, file=file, line=line)
