"""Batch: makes pictures with this process, a pool or a cluster; the command `render` and `glshade.render_all` share it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from glshade.batch.engine import RETRIES, Outcome, Progress
from glshade.batch.task import Task
from glshade.errors import GlshadeError

if TYPE_CHECKING:
    from glshade.batch.maker import Maker
    from glshade.batch.manifest import Manifest
    from glshade.scene.scene import Scene

# Takes the tasks, the maker and the display. Returns the tasks to make, and task number -> scene for scenes that are loaded.
Prepare = Callable[[list[Task], "Maker", "Display"], tuple[list[Task], dict[int, "Scene"]]]


class Display(Progress, Protocol):
    """A display that also shows warnings."""

    def warn(self, text: str) -> None:
        """Shows a warning."""


@dataclass(frozen=True)
class Means:
    """The means by which a batch is made.

    jobs: number of workers; None selects the default
    cluster: "local", or the address of a scheduler; None starts a pool
    device: EGL device for all workers; None spreads them over the GPUs
    backend: OpenGL backend, as for Renderer
    reference: True if the float64 reference draws
    shaders: the user's own shader folders
    models: the user's own model folders
    retries: number of times that a picture is made again after its worker died
    """

    jobs: int | None = None
    cluster: str | None = None
    device: int | None = None
    backend: Any = "auto"
    reference: bool = False
    shaders: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    retries: int = RETRIES


@dataclass(frozen=True)
class Wanted:
    """The files that a batch writes.

    tasks: all pictures
    skipped: those of the tasks whose files are left alone
    resume: True if a picture whose file holds it already is kept
    manifest: path of the manifest; None writes none for a single picture, and manifest.jsonl for several
    cameras: path of a file or folder that tells how the pictures were seen; None writes none
    cameras_format: its format; None follows from the path
    coco: path of a JSON file with the boxes and masks of the objects; None writes none
    """

    tasks: list[Task]
    skipped: list[Task] = field(default_factory=list)
    resume: bool = False
    manifest: Path | None = None
    cameras: Path | None = None
    cameras_format: str | None = None
    coco: Path | None = None


def make(
    wanted: Wanted, means: Means, displayed: Callable[[bool, str | None], Display], prepare: Prepare, *, since: float
) -> Outcome:
    """Makes pictures, their manifest and the files about all of them, and returns the outcome.

    wanted: the files to write
    means: the means to make them
    displayed: takes whether there are several pictures, and the manifest's path if there is one; returns the display
    prepare: checks the scenes, and may change the tasks
    since: value of `perf_counter` when the batch began [s]
    Errors: GlshadeError; KeyboardInterrupt after Ctrl-C, raised once the pictures that were begun are finished.
    """
    skipped = {task.number for task in wanted.skipped}
    tasks = [task for task in wanted.tasks if task.number not in skipped]
    several = len(wanted.tasks) > 1 or means.cluster is not None
    path = wanted.manifest or (_default_manifest(wanted.tasks) if several else None)
    with ExitStack() as stack:
        engine = None
        if several and tasks:
            # The workers start while this process imports further modules and checks the scenes.
            engine = stack.enter_context(_workers(means, len(tasks)))

        from glshade.batch import leftovers
        from glshade.batch.maker import Maker
        from glshade.batch.manifest import Manifest
        from glshade.batch.run import run_batch

        display = displayed(several, str(path) if path else None)
        maker = Maker(means.backend, means.device, means.shaders, means.models)
        stack.callback(maker.close)
        tasks, scenes = prepare(tasks, maker, display)
        if engine is None:
            from glshade.batch.in_process import InProcess

            engine = InProcess(maker, scenes, means.reference)
        if several:
            _make_folders(tasks)
        if wanted.cameras is not None:
            from glshade.batch import cameras

            outputs = {task.output: scenes[task.number] for task in tasks if task.number in scenes}
            cameras.check(wanted.cameras, _cameras_format(wanted, wanted.cameras), outputs)
        if wanted.coco is not None and not wanted.coco.parent.is_dir():
            raise GlshadeError(f"{wanted.coco}: the folder {wanted.coco.parent} does not exist; make it first")
        leftovers.remove(task.output for task in tasks)
        keeps = tasks or (wanted.coco is not None and path is not None and path.is_file())
        log = stack.enter_context(Manifest(path, instances=wanted.coco is not None)) if path and keeps else None
        if log is not None and wanted.resume:
            tasks = [replace(task, known=_known(log, task)) for task in tasks]
        outcome = run_batch(tasks, engine, log, display, skipped=wanted.skipped, since=since)
        _write_about(wanted, outcome, log, display)
    if several:
        # A worker of a command that was killed may have been alive when this batch began, and have ended since.
        leftovers.remove(task.output for task in tasks)
    return outcome


def _known(log: Manifest, task: Task) -> tuple[str, ...]:
    """Returns `Task.known` from the manifest; empty if the task needs its objects and the manifest does not tell them."""
    return log.known(task.output) if not task.instances or log.instances(task.output) else ()


def _cameras_format(wanted: Wanted, path: Path) -> str:
    """Returns the name of the format of the cameras that are written to a path."""
    from glshade.calibration.file import usual_format

    return wanted.cameras_format or usual_format(path)


def _write_about(wanted: Wanted, outcome: Outcome, log: Manifest | None, display: Display) -> None:
    """Writes the files about all pictures: the cameras and the objects. Errors: GlshadeError."""
    if wanted.cameras is not None:
        from glshade.batch import cameras

        name = _cameras_format(wanted, wanted.cameras)
        for missing in cameras.write(wanted.cameras, name, wanted.tasks, outcome.seen):
            display.warn(f"{wanted.cameras}: lacks {missing}, which existed and does not tell how it was seen")
    if wanted.coco is not None:
        from glshade.batch import coco

        kept = {task.number: log.instances(task.output) for task in wanted.tasks} if log else {}
        found: Mapping[int, Mapping[str, Any]] = {n: each for n, each in kept.items() if each} | outcome.instances
        for missing in coco.write(wanted.coco, wanted.tasks, found):
            display.warn(f"{wanted.coco}: lacks {missing}, which existed and whose objects the manifest does not tell")


def existing(tasks: Sequence[Task]) -> str:
    """Returns which of the tasks' files exist, such as "a.png and 3 more"; empty if none does."""
    found = [task.output for task in tasks if os.path.exists(task.output)]
    if not found:
        return ""
    return found[0] + (f" and {len(found) - 1} more" if len(found) > 1 else "")


def _default_manifest(tasks: Sequence[Task]) -> Path:
    """Returns manifest.jsonl in the folder that the pictures have in common."""
    folder = os.path.commonpath([os.path.abspath(os.path.dirname(task.output)) for task in tasks])
    return Path(os.path.relpath(folder)) / "manifest.jsonl"


def _workers(means: Means, pictures: int) -> Any:
    """Starts a pool or a cluster, and returns it: an Engine that is a context manager.

    pictures: number of pictures to make
    Errors: those of Pool and Cluster.
    """
    from glshade.batch.jobs import devices, gpus

    local = means.cluster in (None, "local")
    may_use_gpus = local and means.device is None and not means.reference and means.backend in ("auto", "egl")
    hardware = gpus() if may_use_gpus else []
    assigned = devices(means.jobs, pictures, hardware if means.device is None else [means.device])
    options = {name: getattr(means, name) for name in ("backend", "reference", "shaders", "models", "retries")}
    options |= {"hardware": bool(hardware), "shares": len(assigned) > 1}
    if means.cluster is not None:
        from glshade.batch.cluster import Cluster

        return Cluster(means.cluster, assigned, **options)
    from glshade.batch.pool import Pool

    return Pool(assigned, **options)


def _make_folders(tasks: Sequence[Task]) -> None:
    """Creates the folders of a batch's pictures. The folder of a single picture is not created: it must exist already.

    Errors: GlshadeError.
    """
    for folder in dict.fromkeys(os.path.dirname(task.output) for task in tasks):
        try:
            os.makedirs(folder or ".", exist_ok=True)
        except OSError as error:
            raise GlshadeError(f"{folder}: cannot be made: {error.strerror}") from None
