"""Command `glshade render`: renders scenes or meshes to picture files."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from glshade.calibration.formats import FORMATS as CAMERA_FORMATS
from glshade.cli._options import Crop, Duration, Size, driver, filmed, limits, models, overrides, point_size, shaders
from glshade.image.formats import FORMATS
from glshade.limits import DEFAULT, MOST_TASKS, Limits
from glshade.mesh.formats import SUFFIXES

if TYPE_CHECKING:
    from glshade.batch.batch import Display
    from glshade.batch.frames import Shot
    from glshade.batch.maker import Maker
    from glshade.batch.task import Task
    from glshade.cli._progress import Plain
    from glshade.gl.renderer import Renderer
    from glshade.scene.scene import Scene
    from glshade.tradeoff.choice import Choice


@click.command(epilog=f"Mesh files: {' '.join(SUFFIXES)}")
@click.argument("scenes", metavar="SCENE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    help=f"Picture to write; the extension names the format: {', '.join(FORMATS)}. For several pictures, a pattern with "
    "{scene}, {camera}, a sweep's {key} and a # for each digit of the frame. [default: NAME.png]",
)
@click.option(
    "-f", "--frames", metavar="RANGE", help="Frames of the scene's animation, such as 1-100, 1-100x5, 1,3,7-9 or 1..100."
)
@click.option(
    "--camera", "cameras", multiple=True, metavar="NAME", help="Renders through one of the scene's `cameras`; repeatable."
)
@click.option(
    "--cameras-from",
    type=click.Path(path_type=Path, exists=True),
    metavar="PATH",
    help="Renders through each camera of a file or folder, such as --cameras writes; with --camera, only through those.",
)
@click.option(
    "--cameras",
    "cameras_file",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Writes how each picture was seen to a file, or to a folder (colmap, bop).",
)
@click.option(
    "--cameras-format",
    type=click.Choice(CAMERA_FORMATS),
    help="Format of --cameras. [default: nerf for transforms.json, opencv for other .json files, else colmap]",
)
@click.option(
    "--coco",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Writes the boxes and masks of the objects in all pictures to a JSON file, as COCO defines it.",
)
@click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    metavar="KEY=A,B,C",
    help="Makes a picture for each value, as --set takes it; if repeated, one for each combination.",
)
@click.option(
    "--overwrite", is_flag=True, help="Replaces pictures of a batch that exist. (A single picture is always replaced.)"
)
@click.option("--skip-existing", is_flag=True, help="Skips pictures whose files exist.")
@click.option(
    "--resume", is_flag=True, help="Skips pictures whose files hold the same bytes already, by the hashes in the manifest."
)
@click.option(
    "--jobs",
    type=click.IntRange(1),
    metavar="N",
    help="Number of worker processes. [default: one for each GPU, or else for each core]",
)
@click.option(
    "--cluster", metavar="ADDRESS", help="Runs on dask: `local`, or a scheduler such as tcp://host:8786. Needs glshade[dist]."
)
@click.option(
    "--max-tasks",
    type=click.IntRange(1),
    metavar="N",
    default=MOST_TASKS,
    show_default=True,
    help="Largest number of pictures of a batch.",
)
@click.option(
    "--retries",
    type=click.IntRange(0),
    default=2,
    show_default=True,
    help="Number of times that a picture is made again after its worker died.",
)
@click.option(
    "--manifest",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Log file of all pictures. [default: manifest.jsonl in the folder of a batch; none for a single picture]",
)
@click.option("--json", "as_json", is_flag=True, help="Prints the events of the batch to stdout, one JSON object a line.")
@click.option("--size", type=Size(), help="Overrides the film's size [pixels].")
@click.option("--crop", type=Crop(), help="Draws only this window of the picture, counted from the top left [pixels].")
@click.option("--samples", type=click.Choice(["1", "2", "4", "8"]), help="Overrides the film's samples per pixel.")
@point_size
@click.option("--supersample", type=int, metavar="N", help="Averages N x N pictures, each shifted within the pixel.")
@click.option(
    "--tile", type=click.IntRange(2), metavar="N", help="Largest side of a region that is drawn in one piece [pixels]."
)
@click.option(
    "--shading",
    type=click.Choice(["flat", "gouraud", "phong"]),
    help="Shading per face, per vertex or per pixel, for the whole picture.",
)
@limits
@overrides
@click.option("--reference", is_flag=True, help="Draws with the float64 reference on the CPU, with one sample per pixel.")
@click.option("--exposure", type=float, help="Overrides the film's exposure [stops].")
@click.option("--view", metavar="NAME", help="OpenColorIO view of 8-bit pictures.")
@click.option("--display", metavar="NAME", help="OpenColorIO display of 8-bit pictures.")
@click.option("--ocio", metavar="FILE", help="OpenColorIO configuration: a file, or ocio://NAME.")
@click.option(
    "--aov",
    "aovs",
    multiple=True,
    metavar="NAME[,NAME]",
    help="Writes layers beside the picture, such as depth, normal or lights; repeatable.",
)
@click.option(
    "--aov-format",
    type=click.Choice(["exr", "png"]),
    help="Stores the layers in float32 (exr), or each as a PNG file of codes (png). [default: exr]",
)
@click.option(
    "--budget",
    multiple=True,
    metavar="METRIC=LIMIT",
    help="Draws with the fastest settings whose error stays within a limit, such as max_abs=2e-3. Metrics: max_abs, rmse, "
    "p999, codes, flip. If repeated, all limits hold.",
)
@click.option(
    "--deadline", type=Duration(), help="Draws with the most exact settings that take no longer than this time, such as 5ms."
)
@driver
@shaders
@models
@click.pass_context
def command(
    ctx: click.Context,
    /,
    scenes: tuple[Path, ...],
    output: str | None,
    frames: str | None,
    cameras: tuple[str, ...],
    cameras_from: Path | None,
    cameras_file: Path | None,
    cameras_format: str | None,
    coco: Path | None,
    sweeps: tuple[str, ...],
    overwrite: bool,
    skip_existing: bool,
    resume: bool,
    jobs: int | None,
    cluster: str | None,
    max_tasks: int,
    retries: int,
    manifest: Path | None,
    as_json: bool,
    tile: int | None,
    shading: Any,
    overrides: list[tuple[str, str]],
    limits: Limits,
    reference: bool,
    budget: tuple[str, ...],
    deadline: float | None,
    backend: Any,
    device: int | None,
    shaders: tuple[str, ...],
    models: tuple[str, ...],
    samples: str | None,
    ocio: str | None,
    aovs: tuple[str, ...],
    **film: Any,
) -> None:
    """Renders each SCENE (.toml, .json, or a mesh file) to a picture.

    Several frames, cameras, values or scenes form a batch, which several processes make. A batch does not begin if one of its
    files exists, unless --overwrite, --skip-existing or --resume is given.
    """
    since = perf_counter()
    several = len(scenes) > 1 or len(cameras) > 1 or frames is not None or bool(sweeps) or cluster is not None
    if not several and not reference and backend in ("auto", "egl") and device is None:
        from glshade.gl.egl import load_ahead

        # This process draws the picture itself, and needs a driver once it has read the scene.
        load_ahead()
    from glshade.batch.batch import Means, Wanted, existing, make
    from glshade.image.file import check_suffix

    if output is not None:
        check_suffix(Path(output))
    allowed = _limits(budget)
    if (allowed or deadline) and (reference or shading or (allowed and deadline)):
        raise click.UsageError(
            "--budget and --deadline choose the settings, so they exclude each other, --shading and --reference"
        )
    if overwrite + skip_existing + resume > 1:
        raise click.UsageError("--overwrite, --skip-existing and --resume exclude each other")
    film |= {"samples": samples and int(samples), "ocio": ocio and _configuration(ocio), "aovs": _names(aovs)}
    film = {key: value for key, value in film.items() if value is not None}
    if cameras_format and cameras_file is None:
        raise click.UsageError("--cameras-format needs --cameras, which names the file to write")
    if cameras_from is not None:
        from glshade.calibration.file import named

        cameras = cameras or tuple(named(cameras_from))
        overrides = [("cameras_from", json.dumps(str(cameras_from.absolute()))), *overrides]
    pictures = _pictures(scenes, frames, cameras, output, sweeps, max_tasks)
    raised = {name: value for name, value in asdict(limits).items() if value != getattr(DEFAULT, name)}
    common = {"limits": raised, "film": film, "shading": shading, "reference": reference, "tile": tile, "resume": resume}
    common["instances"] = coco is not None
    tasks = [_task(number, picture, overrides, common) for number, picture in enumerate(pictures)]
    skipped = [task for task in tasks if os.path.exists(task.output)] if skip_existing else []
    if len(tasks) > 1 and not (overwrite or skip_existing or resume) and (there := existing(tasks)):
        raise click.UsageError(f"{there} exists: choose --overwrite, --skip-existing or --resume")
    _check_cluster(cluster, jobs)

    def prepare(wanted: list[Task], maker: Maker, display: Display) -> tuple[list[Task], dict[int, Scene]]:
        first = _checked(wanted, maker, display)
        if not (allowed or deadline):
            return wanted, first
        # --budget and --deadline change the settings of the scenes that were checked, so those are not used again.
        return _at_settings(wanted, first, maker, allowed, deadline), {}

    def displayed(several: bool, path: str | None) -> Plain:
        from glshade.cli._progress import progress

        return progress(as_json, several, path)

    means = Means(jobs, cluster, device, backend, reference, shaders, models, retries)
    wanted = Wanted(tasks, skipped, resume, manifest, cameras_file, cameras_format, coco)
    ctx.exit(make(wanted, means, displayed, prepare, since=since).exit_code)


def _pictures(
    scenes: Sequence[Path],
    frames: str | None,
    cameras: tuple[str, ...],
    output: str | None,
    sweeps: tuple[str, ...],
    most: int,
) -> list[Shot]:
    """Returns the pictures to make, from the values of the options. Errors: click.BadParameter, which names the option."""
    from glshade.batch.frames import check_count, parse, parse_sweep, pictures

    try:
        numbers = None if frames is None else parse(frames)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--frames'") from None
    try:
        swept = [parse_sweep(text) for text in sweeps]
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--sweep'") from None
    try:
        check_count(len(scenes), len(cameras), len(numbers) if numbers else 1, swept, most)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--max-tasks'") from None
    try:
        return list(pictures(scenes, numbers, cameras, output, swept))
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--output'") from None


def _task(number: int, picture: Shot, overrides: Sequence[tuple[str, str]], common: Mapping[str, Any]) -> Task:
    """Returns the task of a picture.

    number: index of the task in the batch
    picture: the picture to make
    overrides: (key, text) pairs of --set, which apply before those of a sweep
    common: fields of Task that are equal for all pictures
    """
    from glshade.batch.task import Task

    changes = (*overrides, *picture.overrides)
    scene, output = str(picture.scene), str(picture.output)
    return Task(number, scene, output, changes, picture.frame, picture.camera, **common)


def _check_cluster(cluster: str | None, jobs: int | None) -> None:
    """Checks the values of --cluster and --jobs. Errors: click.UsageError."""
    if cluster is None:
        return
    from glshade.batch.cluster import LOCAL, check_address

    if jobs and cluster != LOCAL:
        raise click.UsageError("--jobs is for workers on this machine; a scheduler has workers of its own")
    try:
        check_address(cluster)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--cluster'") from None


def _checked(tasks: Sequence[Task], maker: Maker, display: Display) -> dict[int, Scene]:
    """Loads the scene of the first task of each scene file, so that faults are found before a context is opened.

    tasks: the tasks to check
    maker: loads the scenes and keeps their files
    display: prints the warnings
    Returns task number -> scene. Errors: SceneError; click.BadParameter for an invalid film.
    """
    scenes: dict[int, Scene] = {}
    seen: set[str] = set()
    for task in tasks:
        if task.scene not in seen:
            seen.add(task.scene)
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                scenes[task.number] = filmed(maker.scene(replace(task, film={})), task.film)
            for warning in caught:
                display.warn(str(warning.message))
    return scenes


def _at_settings(
    tasks: Sequence[Task], first: Mapping[int, Scene], maker: Maker, limits: dict[str, float], deadline: float | None
) -> list[Task]:
    """Returns the tasks with settings. --budget or --deadline selects them for the first picture of each scene file.

    tasks: the tasks, without settings
    first: number of the first task of each scene file -> the scene
    maker: holds the renderer that measures
    limits: metric -> largest error, of --budget
    deadline: largest time of a picture [s], of --deadline; None if --budget is given
    """
    chosen: dict[str, tuple[Mapping[str, Any], ...]] = {}
    for task in tasks:
        if task.number in first:
            choice = _chosen(first[task.number], maker.renderer, limits, deadline)
            chosen[task.scene] = tuple(setting.as_dict() for setting in choice.settings)
    return [replace(task, settings=chosen[task.scene]) for task in tasks]


def _configuration(text: str) -> str:
    """Returns the value of --ocio with an absolute path: a relative `film.ocio` would start at the scene file's folder."""
    return text if text.startswith("ocio://") else os.path.abspath(text)


def _names(texts: Sequence[str]) -> tuple[str, ...] | None:
    """Returns the names in texts such as `depth,normal`; None if the texts contain no name."""
    return tuple(name.strip() for text in texts for name in text.split(",") if name.strip()) or None


def _limits(texts: tuple[str, ...]) -> dict[str, float]:
    """Returns the limits of --budget: metric -> largest error. Errors: click.BadParameter."""
    if not texts:
        return {}
    from glshade.tradeoff.choice import parse

    try:
        return parse(texts)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--budget'") from None


def _chosen(scene: Scene, renderer: Renderer, limits: dict[str, float], deadline: float | None) -> Choice:
    """Returns the settings that --budget or --deadline selects for a scene, and prints them to stderr."""
    from glshade.tradeoff.budget import choose, within_deadline

    choice = choose(scene, renderer, limits) if deadline is None else within_deadline(scene, renderer, deadline)
    for line in choice.summary(scene).splitlines():
        click.echo(line, err=True)
    return choice
