"""From Python: a batch of pictures as a function, with the workers, the bytes and the manifest of the command `render`."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from glshade.batch import events
from glshade.batch.batch import Means, Wanted, existing, make
from glshade.batch.engine import Outcome
from glshade.batch.frames import check_count, pictures
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import GlshadeError
from glshade.limits import MOST_TASKS

if TYPE_CHECKING:
    from glshade.batch.maker import Maker
    from glshade.scene.scene import Scene

OnEvent = Callable[[dict[str, Any]], None]


def render_all(
    scenes: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    frames: Iterable[int] | None = None,
    cameras: Iterable[str] = (),
    jobs: int | None = None,
    resume: bool = False,
    coco: str | Path | None = None,
    on_event: OnEvent | None = None,
) -> Outcome:
    """Draws every scene through every camera at every frame, and returns how many pictures were made.

    The result is that of `glshade render SCENE... -o OUT`: the files have the same bytes, and a batch has the same manifest. A
    picture that fails does not end the batch; its event tells the error.

    scenes: paths of scene or mesh files
    out: the picture's path or, for several pictures, a pattern with {scene}, {camera} and a # for each digit of the frame
    frames: numbers of the frames or samples; None draws the scenes without animation
    cameras: names of cameras of the scenes; if there are none, the main camera is used
    jobs: number of worker processes; None starts one for each GPU, or else for each core
    resume: True keeps pictures that exist with the same bytes, as --resume does; else a batch refuses to begin if a file exists
    coco: optional; a JSON file for the boxes and masks of the objects in all pictures
    on_event: optional; is called in this thread with each event that --json prints, a dict
    Errors: GlshadeError; SceneError for the first picture of a scene; ValueError for a pattern or too many pictures; TypeError
    for anything but paths.
    """
    since = perf_counter()
    from glshade.image.file import check_suffix

    check_suffix(Path(out))
    tasks = _tasks(_paths(scenes), None if frames is None else list(frames), tuple(cameras), out, resume, coco is not None)
    if len(tasks) > 1 and not resume and (there := existing(tasks)):
        raise GlshadeError(f"{there} exists: remove it, or choose resume=True")
    wanted = Wanted(tasks, resume=resume, coco=None if coco is None else Path(coco))
    return make(wanted, Means(jobs=jobs), lambda several, path: _Events(on_event), _prepare, since=since)


def _paths(scenes: Any) -> list[Path]:
    """Returns the paths of scene files. Errors: TypeError for anything but paths."""
    given = [scenes] if isinstance(scenes, str | os.PathLike) else list(scenes)
    for scene in given:
        if not isinstance(scene, str | os.PathLike):
            raise TypeError(f"render_all takes paths of files, which its processes read, not {type(scene).__name__} objects")
    return [Path(scene) for scene in given]


def _tasks(
    scenes: Sequence[Path],
    frames: Sequence[int] | None,
    cameras: tuple[str, ...],
    out: str | Path,
    resume: bool,
    instances: bool,
) -> list[Task]:
    """Returns the tasks of all pictures. Errors: ValueError."""
    if not scenes or (frames is not None and not frames):
        raise ValueError("there is nothing to draw: name a scene, and a frame or frames=None")
    check_count(len(scenes), len(cameras), len(frames) if frames else 1, [], MOST_TASKS)
    return [
        Task(number, str(shot.scene), str(shot.output), (), shot.frame, shot.camera, resume=resume, instances=instances)
        for number, shot in enumerate(pictures(scenes, frames, cameras, str(out), []))
    ]


def _prepare(tasks: list[Task], maker: Maker, display: Any) -> tuple[list[Task], dict[int, Scene]]:
    """Loads the first scene of each file, so that its faults are raised before any picture is begun. Errors: SceneError."""
    scenes: dict[int, Scene] = {}
    seen: set[str] = set()
    for task in tasks:
        if task.scene not in seen:
            seen.add(task.scene)
            scenes[task.number] = maker.scene(task)
    return tasks, scenes


class _Events:
    """Hands each event to a function. Warnings that belong to no picture become Python's."""

    def __init__(self, on_event: OnEvent | None) -> None:
        self._tell = on_event or (lambda event: None)

    def begin(self, pictures: int, jobs: int, driver: str) -> None:
        self._tell(events.began(pictures, jobs, driver))

    def picture(self, task: Task, record: Record) -> None:
        self._tell(events.picture(task, record))

    def end(self, outcome: Outcome) -> None:
        self._tell(events.ended(outcome))

    def warn(self, text: str) -> None:
        warnings.warn(text, stacklevel=2)
