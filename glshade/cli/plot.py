"""Command `glshade plot`: plots the reflectance of materials as curves and pictures."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

from glshade.cli._options import driver, models, shaders
from glshade.errors import figure

# The values of --kind: the kinds of panels, and "all" for all of them.
KINDS = ("all", "polar", "lobe", "sphere", "furnace", "albedo", "fresnel")
# The options that have an effect on the plots of materials only, not on that of a file of measurements.
OF_MATERIALS = {"kinds", "parameters", "angles", "incidence", "azimuth", "quantity", "scale", "bare"}


class Angles(click.ParamType[tuple[float, ...]]):
    """An option's type: angles of incidence such as `0,30,60` [degrees]."""

    name = "DEGREES,..."

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        try:
            angles = tuple(float(part) for part in value.split(","))
        except ValueError:
            self.fail(f"{value!r} is not a list of angles such as 0,30,60", param, ctx)
        for angle in angles:
            if not 0 <= angle < 90:
                self.fail(f"must be from 0 to less than 90 degrees, not {figure(angle)}", param, ctx)
        return tuple(dict.fromkeys(angles))


@click.command()
@click.argument("materials", metavar="MATERIAL...", nargs=-1, required=True)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Figure to write, as .svg, .png or .pdf. [default: MATERIAL.svg]"
)
@click.option(
    "-k", "--kind", "kinds", type=click.Choice(KINDS), multiple=True, help="Kind of panel to show; repeatable. [default: all]"
)
@click.option(
    "-p",
    "--parameter",
    "parameters",
    metavar="NAME=VALUE",
    multiple=True,
    help="Replaces a parameter of all materials; repeatable.",
)
@click.option(
    "--angles",
    type=Angles(),
    default="0,30,60,80",
    show_default=True,
    help="Angles of incidence of the polar slices [degrees].",
)
@click.option(
    "--incidence",
    type=click.FloatRange(0, 89.9),
    metavar="DEGREES",
    default=45.0,
    show_default=True,
    help="Angle of incidence of the solid lobe [degrees].",
)
@click.option(
    "--azimuth",
    type=float,
    metavar="DEGREES",
    default=0.0,
    show_default=True,
    help="Angle of the plane of incidence from the tangent [degrees].",
)
@click.option(
    "--quantity",
    type=click.Choice(["f-cos", "f"]),
    default="f-cos",
    show_default=True,
    help="Quantity to plot: f-cos, the BRDF times the cosine, or f, the BRDF.",
)
@click.option(
    "--scale",
    type=click.Choice(["auto", "linear", "log"]),
    default="auto",
    show_default=True,
    help="Scale of slices and lobes; auto is logarithmic where a linear scale would hide a curve.",
)
@click.option(
    "--bare", is_flag=True, help="Writes only the picture of --kind lobe, sphere or furnace, in any format of `glshade render`."
)
@click.option(
    "--fit",
    default="ggx",
    show_default=True,
    metavar="MODEL",
    help="Model that is fitted to a file of measurements, beside it.",
)
@driver
@shaders
@models
def command(
    materials: tuple[str, ...],
    output: Path | None,
    kinds: tuple[str, ...],
    parameters: tuple[str, ...],
    angles: tuple[float, ...],
    incidence: float,
    azimuth: float,
    quantity: str,
    scale: Any,
    bare: bool,
    fit: str,
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
) -> None:
    """Plots the reflectance of materials, or of a file of measurements.

    Plots each MATERIAL over the others in one figure. A MATERIAL is a model, a preset, or a material of a scene. In place of
    materials there may be one FILE of measured reflectance, which is plotted beside a fitted model:

    \b
      MODEL    phong    phong:exponent=100    plastic:kd=0.6,0.1,0.05,ior=1.7
      PRESET   gold     gold:roughness=0.5
      SCENE    ball.toml    ball.toml:red    ball.toml:red:ks=0.5
      FILE     krylon_blue.brdf    gold.binary    felt.alta

    Kinds: polar shows slices of the lobe in the plane of incidence; lobe shows the lobe as a solid; sphere shows a sphere under
    one light; furnace shows a sphere under a white sky, where it is invisible if no energy is lost; albedo shows the reflected
    share of the light over the angle of incidence; fresnel shows the exact Fresnel factor and Schlick's, for models with one.

    \b
    Examples:
      glshade plot gold -o gold.svg
      glshade plot phong:exponent={5,50,500} -k polar -k sphere -o exponents.png
      glshade plot ggx beckmann -p roughness=0.3 -k albedo -o rough.svg
      glshade plot plastic -k lobe --scale log --bare -o lobe.png
      glshade plot krylon_blue.brdf --fit ward -o krylon.svg
    """
    import math

    from glshade.catalogue import figures as plots
    from glshade.cli._material import materials as named

    files = [text for text in materials if _is_measured(text)]
    if files:
        _check_alone(files[0], materials)
        _plot_measured(Path(files[0]), output, fit)
        return
    wanted: Any = plots.KINDS if not kinds or "all" in kinds else tuple(dict.fromkeys(kinds))
    if bare and (len(wanted) != 1 or wanted[0] not in plots.PICTURES):
        raise click.UsageError("--bare needs one --kind that is a picture: lobe, sphere or furnace")
    if output is None:
        # The name consists of the materials as they were typed. Characters that are awkward in file names are replaced, and a
        # long name is cut off.
        name = re.sub(r"[^\w.=-]+", "-", "-".join(Path(text).name for text in materials))
        output = Path(name[:80] + (".png" if bare else ".svg"))
    if bare:
        from glshade.image.file import check_suffix

        check_suffix(output)
    else:
        plots.check()
        plots.check_suffix(output)
    chosen = named(materials, parameters)
    if not math.isfinite(azimuth):
        raise click.BadParameter("must be finite", param_hint="'--azimuth'")
    options: Any = {
        "incidence": math.radians(incidence),
        "azimuth": math.radians(azimuth),
        "quantity": quantity.replace("-", " "),
    }
    # The context is opened only after all materials are checked, because checks are quick and opening a context is slow.
    if plots.DRAWN & set(wanted):
        from glshade.gl.renderer import Renderer

        opened: Any = Renderer(backend, device, shaders=shaders)
    else:
        opened = nullcontext()
    with opened as renderer:
        if bare:
            _bare(chosen, wanted[0], options, scale, renderer).save(output)
        else:
            radians = tuple(math.radians(angle) for angle in angles)
            plots.save(plots.figure(chosen, wanted, angles=radians, scale=scale, renderer=renderer, **options), output)
    click.echo(str(output))


def _is_measured(text: str) -> bool:
    """Returns whether a text of the command line names a file of measured reflectance: a file that is no scene, or a missing
    file with the suffix of such a format.
    """
    from glshade.measured.formats import FORMATS

    suffix = Path(text).suffix.lower()
    if suffix in ("", ".toml", ".json") or ":" in text:
        return False
    return suffix.removeprefix(".") in FORMATS or Path(text).is_file()


def _check_alone(file: str, materials: tuple[str, ...]) -> None:
    """Refuses materials and options that have no effect on the plot of a file. Errors: click.UsageError."""
    if len(materials) > 1:
        raise click.UsageError(f"{file} is a file of measurements, which is plotted alone, beside the model of --fit")
    context = click.get_current_context()
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "") is click.core.ParameterSource.COMMANDLINE
        if given and option.name in OF_MATERIALS:
            raise click.UsageError(f"{max(option.opts, key=len)} has no effect on the plot of a file of measurements")


def _plot_measured(file: Path, output: Path | None, name: str) -> None:
    """Plots a file of measured reflectance beside a fit of the model of this name. Errors: GlshadeError, click.BadParameter."""
    from glshade.brdfs import BRDFS
    from glshade.catalogue import figures, measured_figures
    from glshade.catalogue.fitting import fit_model
    from glshade.document import nearest
    from glshade.measured.file import load
    from glshade.measured.reading import read
    from glshade.measured.samples import Samples, points
    from glshade.measured.tabulation import is_grained

    output = output or Path(file.stem + ".svg")
    figures.check()
    figures.check_suffix(output)
    fitted = [known for known in BRDFS if BRDFS[known].has_reference and not BRDFS[known].tables]
    if name not in fitted:
        raise click.BadParameter(f"no model that can be fitted is named {name!r}{nearest(name, fitted)}", param_hint="'--fit'")
    measurement = read(file)
    grained = isinstance(measurement, Samples) and is_grained(measurement)
    samples = points(measurement, 20_000)
    drawn = measured_figures.figure(file.name, samples, None if grained else load(file), fit_model(measurement, BRDFS[name]))
    figures.save(drawn, output)
    click.echo(str(output))


def _bare(materials: Any, kind: str, options: Any, scale: str, renderer: Any) -> Any:
    """Draws the pictures of materials side by side.

    materials: label -> material
    kind: "furnace", "sphere" or "lobe"
    options: incidence and azimuth [rad] and quantity, for a lobe
    scale: "auto", "linear" or "log", for a lobe
    renderer: the renderer; None for "furnace", which needs none
    """
    from glshade.catalogue import pictures

    images = []
    for material in materials.values():
        if kind == "furnace":
            images.append(pictures.furnace(material, 512)[0])
            continue
        if kind == "sphere":
            scene = pictures.sphere(material, 512)
        else:
            scene, _ = pictures.solid(material, **options, scale="log" if scale == "log" else "linear", size=800)
        # The renderer reuses the memory of its picture for the next one.
        image = renderer.render(scene, dtype="float32")
        images.append(type(image)(image.pixels.copy()))
    return pictures.side_by_side(images)
