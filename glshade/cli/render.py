"""glshade render: a scene or a mesh goes in, a picture comes out."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from glshade.frames import Picture
    from glshade.gl.renderer import Renderer
    from glshade.scene import Scene
    from glshade.scene_file import SceneFile
    from glshade.tradeoff.budget import Choice


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


class Duration(click.ParamType[float]):
    """`5ms`, `0.2s`; a bare number is in milliseconds. Gives seconds."""

    name = "TIME"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        match = re.fullmatch(r"([0-9.]+(?:e-?\d+)?)\s*(ms|s|)", value)
        try:
            seconds = float(match[1]) * (1.0 if match[2] == "s" else 1e-3) if match else 0.0
        except ValueError:
            seconds = 0.0
        if not seconds > 0:
            self.fail(f"{value!r} is not a time such as 5ms or 0.2s", param, ctx)
        return seconds


def overrides(command: Any) -> Any:
    """The option --set, which gives `overrides`: (key, text), as `glshade.load` takes them."""
    return click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="KEY=VALUE",
        callback=lambda ctx, param, texts: _assignments(texts, param),
        help="Puts a value in the place of the scene's: quality.fresnel=schlick, materials.body.roughness=0.3, "
        "objects.ball.material=gold, lights.0.intensity=2, film.size=[640,360]; repeatable.",
    )(command)


def _assignments(texts: tuple[str, ...], option: click.Parameter) -> list[tuple[str, str]]:
    if not texts:
        return []
    from glshade.override import split

    try:
        return [split(text) for text in texts]
    except ValueError as error:
        raise click.BadParameter(str(error), param=option) from None


@click.command()
@click.argument("scenes", metavar="SCENE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    help="Picture to write; the extension says how: png, jpg, tif, exr, hdr. Of several pictures: a pattern with {scene}, "
    "{camera} and a # for each digit of the frame. [default: NAME.png]",
)
@click.option("-f", "--frames", metavar="RANGE", help="Frames of the scene's animation: 1-100, 1-100x5, 1,3,7-9, 1..100.")
@click.option(
    "--camera", "cameras", multiple=True, metavar="NAME", help="Looks through one of the scene's `cameras`; repeatable."
)
@click.option(
    "--overwrite", is_flag=True, help="Of several pictures: replaces those that are there. (One picture always does.)"
)
@click.option("--skip-existing", is_flag=True, help="Leaves out pictures whose files are there.")
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@click.option("--samples", type=click.Choice(["1", "2", "4", "8"]), help="Overrides the film's samples a pixel.")
@click.option(
    "--shading",
    type=click.Choice(["flat", "gouraud", "phong"]),
    help="Per face, per vertex or per pixel, for the whole picture.",
)
@overrides
@click.option("--reference", is_flag=True, help="Drawn by the float64 reference, on the CPU; one sample a pixel.")
@click.option("--exposure", type=float, help="Overrides the film's exposure [stops].")
@click.option(
    "--budget",
    multiple=True,
    metavar="METRIC=LIMIT",
    help="Draws with the cheapest settings whose error stays within it: max_abs=2e-3, rmse=, p999=, codes=, flip=.",
)
@click.option("--deadline", type=Duration(), help="Draws as exactly as can be in a time: 5ms.")
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
def command(
    scenes: tuple[Path, ...],
    output: str | None,
    frames: str | None,
    cameras: tuple[str, ...],
    overwrite: bool,
    skip_existing: bool,
    size: tuple[int, int] | None,
    samples: str | None,
    shading: Any,
    overrides: list[tuple[str, str]],
    reference: bool,
    exposure: float | None,
    budget: tuple[str, ...],
    deadline: float | None,
    backend: Any,
    device: int | None,
) -> None:
    """Renders scenes (.toml, .json, or a mesh: .obj .ply .stl .off .glb .gltf) to pictures.

    Several frames, cameras or scenes are a batch: it refuses to begin where one of its pictures is there already, unless told
    to --overwrite or to --skip-existing.
    """
    from glshade.picture_file import FLOAT_SUFFIXES, check_suffix
    from glshade.scene_file import SceneFile

    if output is not None:
        check_suffix(Path(output))
    limits = _limits(budget)
    if (limits or deadline) and (reference or shading or (limits and deadline)):
        raise click.UsageError("--budget and --deadline choose the settings: not together, nor with --shading or --reference")
    film = {"size": size, "samples": samples and int(samples), "exposure": exposure}
    wanted = _pictures([SceneFile(path, overrides) for path in scenes], frames, cameras, output)
    if skip_existing:
        wanted = [picture for picture in wanted if not picture.output.exists()]
    elif len(wanted) > 1 and not overwrite:
        there = [picture.output for picture in wanted if picture.output.exists()]
        if there:
            more = f" and {len(there) - 1} more" if len(there) > 1 else ""
            raise click.UsageError(f"{there[0]}{more} exists: --overwrite or --skip-existing?")
    if not wanted:
        return

    def loaded(picture: Picture) -> Scene:
        return filmed(picture.scene.scene(picture.frame, picture.camera), film)

    # Only a scene without faults is worth a context.
    first = loaded(wanted[0])
    if reference:
        from glshade.reference import render

        for picture in wanted:
            scene = loaded(picture)
            image = render(scene, shading=shading)
            linear = picture.output.suffix.lower() in FLOAT_SUFFIXES
            (image if linear else image.encoded(scene.film.encoding)).save(picture.output)
            click.echo(str(picture.output))
        return
    from glshade.gl.renderer import Renderer

    with Renderer(backend, device) as renderer:
        chosen: dict[Path, Choice] = {}
        for number, picture in enumerate(wanted):
            scene = loaded(picture) if number else first
            if limits or deadline:
                path = picture.scene.path
                if path not in chosen:
                    chosen[path] = _chosen(scene, renderer, limits, deadline)
                scene = chosen[path].applied(scene)
            linear = picture.output.suffix.lower() in FLOAT_SUFFIXES
            renderer.render(scene, dtype="float32" if linear else "uint8", shading=shading).save(picture.output)
            click.echo(str(picture.output))


def _pictures(files: list[SceneFile], frames: str | None, cameras: tuple[str, ...], output: str | None) -> list[Picture]:
    from glshade.frames import parse, pictures

    try:
        numbers = None if frames is None else parse(frames)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--frames'") from None
    try:
        return list(pictures(files, numbers, cameras, output))
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--output'") from None


def filmed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """The scene on another film; None changes nothing. Errors: click.BadParameter, of the option named as the film's key."""
    changes = {key: value for key, value in changes.items() if value is not None}
    if not changes:
        return scene
    from pydantic import ValidationError

    from glshade.scene import Film

    try:
        film = Film.model_validate({**scene.film.model_dump(), **changes})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise click.BadParameter(first["msg"], param_hint=f"'--{first['loc'][0]}'") from None
    return scene.model_copy(update={"film": film})


def _limits(texts: tuple[str, ...]) -> dict[str, float]:
    if not texts:
        return {}
    from glshade.tradeoff.budget import parse

    try:
        return parse(texts)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--budget'") from None


def _chosen(scene: Scene, renderer: Renderer, limits: dict[str, float], deadline: float | None) -> Choice:
    """The settings that are good enough, or quick enough, and a word on stderr."""
    from glshade.tradeoff.budget import choose, within_deadline

    choice = choose(scene, renderer, limits) if deadline is None else within_deadline(scene, renderer, deadline)
    for line in choice.says(scene).splitlines():
        click.echo(line, err=True)
    return choice
