"""Loop: draws a scene to a picture file again whenever one of its files changes, without a server."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, time
from typing import Any

from glshade.image.file import check_suffix
from glshade.live.child import Child, ChildLost
from glshade.live.messages import Answer, Load, Loaded, Save
from glshade.live.watcher import Watcher
from glshade.problem import Problem


@dataclass(frozen=True)
class Redrawn:
    """The result of one change.

    number: the number of the change, from 1.
    ok: whether the picture was drawn and written.
    seconds: the time from the change to the picture [s].
    problems: the faults of the files, one table each; see `Problem.as_dict`.
    """

    number: int
    ok: bool
    seconds: float
    problems: list[dict[str, Any]] = field(default_factory=list)


async def redraw(
    scene: str,
    output: str,
    report: Callable[[Redrawn], None],
    *,
    overrides: tuple[str, ...] = (),
    shaders: tuple[str, ...] = (),
    models: tuple[str, ...] = (),
    size: tuple[int, int] | None = None,
    backend: str = "auto",
    device: int | None = None,
) -> None:
    """Draws a scene to a file, and again after each change of a file that the picture depends on, until it is cancelled.

    A picture that cannot be drawn leaves the file as it is.
    scene: the path of the scene or mesh file.
    output: the path of the picture; its suffix names the format.
    report: is called after each change.
    overrides: texts KEY=VALUE, as `--set` takes them.
    shaders, models: the paths of the user's shader and model folders.
    size: optional; width and height [pixels] in place of the film's.
    backend, device: as for Renderer.
    Errors: GlshadeError for a suffix that names no format.
    """
    check_suffix(output)
    async with AsyncExitStack() as stack:
        folder = stack.enter_context(TemporaryDirectory(prefix="glshade-"))
        child = Child("glshade.live.drawer", backend, "" if device is None else device, folder)
        stack.push_async_callback(child.stop)
        watcher = Watcher()
        watcher.watch([scene, *shaders, *models])
        load = Load(revision=1, scene=scene, overrides=overrides, shaders=shaders, models=models, size=size)
        report(await _redrawn(child, watcher, load, output))
        async for _ in watcher.changes():
            load = replace(load, revision=load.revision + 1)
            report(await _redrawn(child, watcher, load, output))


async def _redrawn(child: Child, watcher: Watcher, load: Load, output: str) -> Redrawn:
    """Loads a scene and writes its picture."""
    start, began = perf_counter(), time()
    try:
        answer = await _loaded(child, load)
        watcher.watch([*answer.dependencies, *answer.folders], since=began)
        last: Answer = answer
        if answer.ok:
            last = await child.ask(Save(path=str(Path(output).absolute())))
        problems = getattr(last, "problems", [])
        return Redrawn(load.revision, last.ok, perf_counter() - start, problems)
    except ChildLost as lost:
        problem = Problem(load.scene, None, None, f"the process that draws {lost}", "driver")
        return Redrawn(load.revision, False, perf_counter() - start, [problem.as_dict()])


async def _loaded(child: Child, load: Load) -> Loaded:
    """Returns the answer to a request to load a scene. A process that runs older models is replaced. Errors: ChildLost."""
    answer = await child.ask(load)
    if isinstance(answer, Loaded) and answer.restart:
        await child.stop()
        answer = await child.ask(load)
    if not isinstance(answer, Loaded):
        return Loaded(id=0, ok=False, revision=load.revision, shown=0, problems=getattr(answer, "problems", []))
    return answer
