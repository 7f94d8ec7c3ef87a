"""glshade render: a scene or a mesh goes in, a picture comes out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click


class Size(click.ParamType[tuple[int, int]]):
    """`640x480`."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"(\d+)x(\d+)", value)
        if not match or "0" in match.groups():
            self.fail(f"{value!r} is not a size such as 640x480", param, ctx)
        return int(match[1]), int(match[2])


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Picture to write; the extension says how: png, jpg, tif, exr, hdr. [default: NAME.png]",
)
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@click.option("--samples", type=click.Choice(["1", "2", "4", "8"]), help="Overrides the film's samples a pixel.")
@click.option(
    "--shading",
    type=click.Choice(["flat", "gouraud", "phong"]),
    help="Per face, per vertex or per pixel, for the whole picture.",
)
@click.option("--reference", is_flag=True, help="Drawn by the float64 reference, on the CPU; one sample a pixel.")
@click.option("--exposure", type=float, help="Overrides the film's exposure [stops].")
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
def command(
    scene: Path,
    output: Path | None,
    size: tuple[int, int] | None,
    samples: str | None,
    shading: Any,
    reference: bool,
    exposure: float | None,
    backend: Any,
    device: int | None,
) -> None:
    """Renders SCENE (.toml, .json, or a mesh: .obj .ply .stl .off .glb .gltf) to a picture."""
    from pydantic import ValidationError

    from glshade.image import FLOAT_SUFFIXES, check_suffix
    from glshade.scene import Film
    from glshade.scene_file import load

    if output is not None:
        check_suffix(output)
    loaded = load(scene)
    output = output or Path(f"{scene.stem}.png")
    wanted = {"size": size, "samples": samples and int(samples), "exposure": exposure}
    changes = {key: value for key, value in wanted.items() if value is not None}
    if changes:
        try:
            film = Film.model_validate({**loaded.film.model_dump(), **changes})
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise click.BadParameter(first["msg"], param_hint=f"'--{first['loc'][0]}'") from None
        loaded = loaded.model_copy(update={"film": film})
    if reference:
        from glshade.reference import render

        picture = render(loaded, shading=shading)
        (picture if output.suffix.lower() in FLOAT_SUFFIXES else picture.encoded(loaded.film.encoding)).save(output)
        click.echo(str(output))
        return
    # Only a scene without faults is worth a context.
    from glshade.gl.renderer import Renderer

    with Renderer(backend, device) as renderer:
        linear = output.suffix.lower() in FLOAT_SUFFIXES
        image = renderer.render(loaded, dtype="float32" if linear else "uint8", shading=shading)
        image.save(output)
    click.echo(str(output))
