"""glshade plot: what materials do with light, as curves and pictures."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

KINDS = ("all", "polar", "lobe", "sphere", "furnace", "albedo", "fresnel")


class Angles(click.ParamType[tuple[float, ...]]):
    """`0,30,60`: degrees."""

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
                self.fail(f"must be from 0 to less than 90 degrees, not {angle:g}", param, ctx)
        return tuple(dict.fromkeys(angles))


@click.command()
@click.argument("materials", metavar="MATERIAL...", nargs=-1, required=True)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Figure to write: .svg, .png or .pdf. [default: MATERIAL.svg]"
)
@click.option(
    "-k", "--kind", "kinds", type=click.Choice(KINDS), multiple=True, help="What to show, as often as wanted. [default: all]"
)
@click.option(
    "-p", "--parameter", "parameters", metavar="NAME=VALUE", multiple=True, help="Of all materials; as often as wanted."
)
@click.option(
    "--angles", type=Angles(), default="0,30,60,80", show_default=True, help="Of incidence, of the polar slices [degrees]."
)
@click.option(
    "--incidence",
    type=click.FloatRange(0, 89.9),
    metavar="DEGREES",
    default=45.0,
    show_default=True,
    help="Of the solid lobe [degrees].",
)
@click.option(
    "--azimuth",
    type=float,
    metavar="DEGREES",
    default=0.0,
    show_default=True,
    help="Of the plane of incidence, from the tangent [degrees].",
)
@click.option(
    "--quantity",
    type=click.Choice(["f-cos", "f"]),
    default="f-cos",
    show_default=True,
    help="The light that leaves, or the BRDF.",
)
@click.option(
    "--scale",
    type=click.Choice(["auto", "linear", "log"]),
    default="auto",
    show_default=True,
    help="Of slices and lobes; auto: by the log where a linear one would hide a curve.",
)
@click.option("--bare", is_flag=True, help="Only the picture, for --kind lobe, sphere or furnace; EXR, JPEG and others too.")
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
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
    backend: Any,
    device: int | None,
) -> None:
    """Plots MATERIALs, laid over each other: models, presets, or the materials of a scene.

    \b
      MODEL    phong    phong:exponent=100    plastic:kd=0.6,0.1,0.05,ior=1.7
      PRESET   gold     gold:roughness=0.5
      SCENE    ball.toml    ball.toml:red    ball.toml:red:ks=0.5

    Kinds: polar, slices of the lobe in the plane of incidence; lobe, the lobe as a solid; sphere, one under one light;
    furnace, a sphere under a white sky, where nothing lost is nothing seen; albedo, what is reflected in all, over the angle;
    fresnel, of models that have it, exact and Schlick's.

    \b
    Examples:
      glshade plot gold -o gold.svg
      glshade plot phong:exponent={5,50,500} -k polar -k sphere -o exponents.png
      glshade plot ggx beckmann -p roughness=0.3 -k albedo -o rough.svg
      glshade plot plastic -k lobe --scale log --bare -o lobe.png
    """
    import math

    from glshade.catalogue import figures as plots
    from glshade.cli._material import materials as named

    wanted: Any = plots.KINDS if not kinds or "all" in kinds else tuple(dict.fromkeys(kinds))
    if bare and (len(wanted) != 1 or wanted[0] not in plots.PICTURES):
        raise click.UsageError("--bare needs one --kind that is a picture: lobe, sphere or furnace")
    if output is None:
        # As it was typed, without what a file name should not have.
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
    # Only materials without faults are worth a context.
    if plots.DRAWN & set(wanted):
        from glshade.gl.renderer import Renderer

        opened: Any = Renderer(backend, device)
    else:
        opened = nullcontext()
    with opened as renderer:
        if bare:
            _bare(chosen, wanted[0], options, scale, renderer).save(output)
        else:
            radians = tuple(math.radians(angle) for angle in angles)
            plots.save(plots.figure(chosen, wanted, angles=radians, scale=scale, renderer=renderer, **options), output)
    click.echo(str(output))


def _bare(materials: Any, kind: str, options: Any, scale: str, renderer: Any) -> Any:
    """The pictures side by side."""
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
        # The picture is the renderer's until it draws the next.
        image = renderer.render(scene, dtype="float32")
        images.append(type(image)(image.pixels.copy()))
    return pictures.side_by_side(images)
