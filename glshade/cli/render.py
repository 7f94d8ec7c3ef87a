"""glshade render: scenes or meshes go in, pictures come out."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from glshade.batch.frames import Picture
    from glshade.batch.maker import Maker
    from glshade.batch.task import Task
    from glshade.cli._progress import Plain
    from glshade.gl.renderer import Renderer
    from glshade.scene.scene import Scene
    from glshade.tradeoff.budget import Choice

# The film's keys whose options are called otherwise.
OPTIONS = {"aovs": "aov"}


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


class Crop(click.ParamType[tuple[int, int, int, int]]):
    """`10,20,64x48`."""

    name = "X,Y,WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int, int, int]:
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"(\d+),(\d+),(\d+)x(\d+)", value)
        if not match:
            self.fail(f"{value!r} is not a window such as 10,20,64x48", param, ctx)
        x, y, width, height = map(int, match.groups())
        return x, y, width, height


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
    from glshade.scene.override import split

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
    "{camera}, a sweep's {key} and a # for each digit of the frame. [default: NAME.png]",
)
@click.option("-f", "--frames", metavar="RANGE", help="Frames of the scene's animation: 1-100, 1-100x5, 1,3,7-9, 1..100.")
@click.option(
    "--camera", "cameras", multiple=True, metavar="NAME", help="Looks through one of the scene's `cameras`; repeatable."
)
@click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    metavar="KEY=A,B,C",
    help="A picture for each of the values, as --set takes them; repeated, for each combination.",
)
@click.option(
    "--overwrite", is_flag=True, help="Of several pictures: replaces those that are there. (One picture always does.)"
)
@click.option("--skip-existing", is_flag=True, help="Leaves out pictures whose files are there.")
@click.option("--resume", is_flag=True, help="Leaves out pictures whose files say that they are these very pictures.")
@click.option("--jobs", type=click.IntRange(1), metavar="N", help="Worker processes. [default: one a GPU, else one a core]")
@click.option(
    "--cluster", metavar="ADDRESS", help="Works on dask: `local`, or a scheduler such as tcp://host:8786; needs glshade[dist]."
)
@click.option(
    "--retries",
    type=click.IntRange(0),
    default=2,
    show_default=True,
    help="Times that a picture whose worker died is made again.",
)
@click.option(
    "--manifest",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Log of what came of every picture. [default: of several pictures, manifest.jsonl in their folder]",
)
@click.option("--json", "as_json", is_flag=True, help="What happens, on stdout, one JSON object a line.")
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@click.option("--crop", type=Crop(), help="Draws this window of the picture alone; from the top left [pixels].")
@click.option("--samples", type=click.Choice(["1", "2", "4", "8"]), help="Overrides the film's samples a pixel.")
@click.option("--supersample", type=int, metavar="N", help="The mean of N x N pictures, shifted within the pixel.")
@click.option("--tile", type=click.IntRange(2), metavar="N", help="Largest side drawn in one piece [pixels].")
@click.option(
    "--shading",
    type=click.Choice(["flat", "gouraud", "phong"]),
    help="Per face, per vertex or per pixel, for the whole picture.",
)
@overrides
@click.option("--reference", is_flag=True, help="Drawn by the float64 reference, on the CPU; one sample a pixel.")
@click.option("--exposure", type=float, help="Overrides the film's exposure [stops].")
@click.option("--view", metavar="NAME", help="OpenColorIO view of 8-bit pictures.")
@click.option("--display", metavar="NAME", help="OpenColorIO display of 8-bit pictures.")
@click.option("--ocio", metavar="FILE", help="OpenColorIO configuration: a file, or ocio://NAME.")
@click.option(
    "--aov",
    "aovs",
    multiple=True,
    metavar="NAME[,NAME]",
    help="Layers beside the picture: depth, normal, lights, ...; repeatable.",
)
@click.option(
    "--budget",
    multiple=True,
    metavar="METRIC=LIMIT",
    help="Draws with the cheapest settings whose error stays within it: max_abs=2e-3, rmse=, p999=, codes=, flip=.",
)
@click.option("--deadline", type=Duration(), help="Draws as exactly as can be in a time: 5ms.")
@click.option("--backend", type=click.Choice(["auto", "egl", "osmesa", "standalone"]), default="auto", show_default=True)
@click.option("--device", type=int, help="EGL device, as `glshade devices` counts them.")
@click.pass_context
def command(
    ctx: click.Context,
    /,
    scenes: tuple[Path, ...],
    output: str | None,
    frames: str | None,
    cameras: tuple[str, ...],
    sweeps: tuple[str, ...],
    overwrite: bool,
    skip_existing: bool,
    resume: bool,
    jobs: int | None,
    cluster: str | None,
    retries: int,
    manifest: Path | None,
    as_json: bool,
    tile: int | None,
    shading: Any,
    overrides: list[tuple[str, str]],
    reference: bool,
    budget: tuple[str, ...],
    deadline: float | None,
    backend: Any,
    device: int | None,
    samples: str | None,
    ocio: str | None,
    aovs: tuple[str, ...],
    **film: Any,
) -> None:
    """Renders scenes (.toml, .json, or a mesh: .obj .ply .stl .off .glb .gltf) to pictures.

    Several frames, cameras, values or scenes are a batch, made by several processes: it refuses to begin where one of its
    pictures is there already, unless told to --overwrite, to --skip-existing or to --resume.
    """
    since = perf_counter()
    from glshade.image.file import check_suffix

    if output is not None:
        check_suffix(Path(output))
    limits = _limits(budget)
    if (limits or deadline) and (reference or shading or (limits and deadline)):
        raise click.UsageError("--budget and --deadline choose the settings: not together, nor with --shading or --reference")
    if overwrite + skip_existing + resume > 1:
        raise click.UsageError("--overwrite, --skip-existing and --resume exclude each other")
    film |= {"samples": samples and int(samples), "ocio": ocio and _configuration(ocio), "aovs": _names(aovs)}
    film = {key: value for key, value in film.items() if value is not None}
    pictures = _pictures(scenes, frames, cameras, output, sweeps)
    common = {"film": film, "shading": shading, "reference": reference, "tile": tile, "resume": resume}
    tasks = [_task(number, picture, overrides, common) for number, picture in enumerate(pictures)]
    several = len(tasks) > 1 or cluster is not None
    skipped = [task for task in tasks if os.path.exists(task.output)] if skip_existing else []
    if len(tasks) > 1 and not (overwrite or skip_existing or resume):
        _refuse_existing(tasks)
    left = {task.number for task in tasks} - {task.number for task in skipped}
    wanted = [task for task in tasks if task.number in left]
    if several and manifest is None:
        folder = os.path.commonpath([os.path.abspath(os.path.dirname(task.output)) for task in tasks])
        manifest = Path(os.path.relpath(folder)) / "manifest.jsonl"

    with ExitStack() as stack:
        workers = None
        if several and wanted:
            # They start while this process imports what it takes to look at the scenes, and does.
            workers = stack.enter_context(_workers(cluster, jobs, len(wanted), backend, device, reference, retries))

        from glshade.batch import leftovers
        from glshade.batch.maker import Maker
        from glshade.batch.manifest import Manifest
        from glshade.batch.run import run
        from glshade.cli._progress import progress

        shown = progress(as_json, several, str(manifest) if manifest else None)
        maker = Maker(backend, device)
        stack.callback(maker.close)
        first = _checked(wanted, maker, shown)
        if limits or deadline:
            wanted = _at_settings(wanted, first, maker, limits, deadline)
        if workers is None:
            from glshade.batch.here import Here

            # A budget's choice changes the scene that was checked.
            workers = Here(maker, {} if limits or deadline else first, reference)
        if several:
            _make_folders(wanted)
        leftovers.remove(task.output for task in wanted)
        log = stack.enter_context(Manifest(manifest)) if manifest and wanted else None
        outcome = run(wanted, workers, log, shown, skipped=skipped, since=since)
    ctx.exit(outcome.exit_code)


def _pictures(
    scenes: Sequence[Path], frames: str | None, cameras: tuple[str, ...], output: str | None, sweeps: tuple[str, ...]
) -> list[Picture]:
    from glshade.batch.frames import parse, parse_sweep, pictures

    try:
        numbers = None if frames is None else parse(frames)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--frames'") from None
    try:
        swept = [parse_sweep(text) for text in sweeps]
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--sweep'") from None
    try:
        return list(pictures(scenes, numbers, cameras, output, swept))
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--output'") from None


def _task(number: int, picture: Picture, overrides: Sequence[tuple[str, str]], common: Mapping[str, Any]) -> Task:
    from glshade.batch.task import Task

    changes = (*overrides, *picture.overrides)
    scene, output = str(picture.scene), str(picture.output)
    return Task(number, scene, output, changes, picture.frame, picture.camera, **common)


def _refuse_existing(tasks: Sequence[Task]) -> None:
    there = [task.output for task in tasks if os.path.exists(task.output)]
    if there:
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise click.UsageError(f"{there[0]}{more} exists: --overwrite, --skip-existing or --resume?")


def _workers(
    cluster: str | None, jobs: int | None, pictures: int, backend: str, device: int | None, reference: bool, retries: int
) -> Any:
    """A pool or a cluster, started: an Engine that is a context manager."""
    from glshade.batch.jobs import devices, gpus

    own = cluster in (None, "local")
    if jobs and not own:
        raise click.UsageError("--jobs is for workers of this machine: a scheduler has its own")
    if reference or backend not in ("auto", "egl"):
        found = []
    else:
        found = gpus() if device is None and own else []
    on = devices(jobs, pictures, found if device is None else [device])
    how: dict[str, Any] = {"backend": backend, "reference": reference, "retries": retries}
    if cluster is not None:
        from glshade.batch.cluster import Cluster, check_address

        try:
            check_address(cluster)
        except ValueError as error:
            raise click.BadParameter(str(error), param_hint="'--cluster'") from None
        return Cluster(cluster, on, hardware=bool(found), shares=len(on) > 1, **how)
    from glshade.batch.pool import Pool

    return Pool(on, hardware=bool(found), shares=len(on) > 1, **how)


def _checked(tasks: Sequence[Task], maker: Maker, shown: Plain) -> dict[int, Scene]:
    """The first picture of every file, by its number: only a scene without faults is worth a context.

    Errors: SceneError; click.BadParameter for a film that cannot be.
    """
    found: dict[int, Scene] = {}
    seen: set[str] = set()
    for task in tasks:
        if task.scene not in seen:
            seen.add(task.scene)
            with warnings.catch_warnings(record=True) as heard:
                warnings.simplefilter("always")
                found[task.number] = filmed(maker.scene(replace(task, film={})), task.film)
            for warning in heard:
                shown.warn(str(warning.message))
    return found


def _at_settings(
    tasks: Sequence[Task], first: Mapping[int, Scene], maker: Maker, limits: dict[str, float], deadline: float | None
) -> list[Task]:
    """The tasks with what is good enough, or quick enough, for the first picture of their file."""
    chosen: dict[str, tuple[Mapping[str, Any], ...]] = {}
    for task in tasks:
        if task.number in first:
            choice = _chosen(first[task.number], maker.renderer, limits, deadline)
            chosen[task.scene] = tuple(setting.as_dict() for setting in choice.settings)
    return [replace(task, settings=chosen[task.scene]) for task in tasks]


def _make_folders(tasks: Sequence[Task]) -> None:
    """Those that a pattern names; one picture has to find its folder there. Errors: GlshadeError."""
    from glshade.errors import GlshadeError

    for folder in dict.fromkeys(os.path.dirname(task.output) for task in tasks):
        try:
            os.makedirs(folder or ".", exist_ok=True)
        except OSError as error:
            raise GlshadeError(f"{folder}: cannot be made: {error.strerror}") from None


def _configuration(text: str) -> str:
    """Beside the command, not beside the scene."""
    return text if text.startswith("ocio://") else os.path.abspath(text)


def _names(texts: Sequence[str]) -> tuple[str, ...] | None:
    return tuple(name.strip() for text in texts for name in text.split(",") if name.strip()) or None


def filmed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """The scene on another film; None changes nothing. Errors: click.BadParameter, of the option named as the film's key."""
    changes = {key: value for key, value in changes.items() if value is not None}
    if not changes:
        return scene
    from pydantic import ValidationError

    from glshade.scene.scene import Film

    try:
        film = Film.model_validate({**scene.film.model_dump(), **changes})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = str(first["loc"][0])
        raise click.BadParameter(first["msg"], param_hint=f"'--{OPTIONS.get(key, key)}'") from None
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
