"""Maker: makes the pictures of tasks, and keeps what the next one needs too: the context, the scenes, what they compile to."""

from __future__ import annotations

import hashlib
import warnings
from collections import OrderedDict
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryFile
from time import perf_counter, time
from typing import TYPE_CHECKING, Any, cast

from pydantic import ValidationError

from glshade.batch.digest import ATTRIBUTE, digest, digest_of
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import GlshadeError, SceneError
from glshade.image.file import FLOAT_SUFFIXES
from glshade.image.image import Image
from glshade.scene.file import SceneFile
from glshade.scene.scene import Film, Scene

if TYPE_CHECKING:
    from glshade.gl.context import Backend
    from glshade.gl.renderer import Renderer
    from glshade.image.layers import Layers

# What a picture may fail by without being a fault in glshade.
FAULTS = (GlshadeError, OSError, MemoryError)
# Scene files at hand: a sweep has one for each of its values, and goes through them once.
KEPT_FILES = 16
# A look at whether a folder takes a file as large as the picture's pixels goes no further than this [bytes].
MOST_PROBED = 64 << 20


class Maker:
    """Makes pictures on one context, opened at the first need. backend, device: as for Renderer.

    A context belongs to the thread that uses it first: so does a Maker; only `Drawn.write` may be called from another.
    """

    def __init__(self, backend: Backend = "auto", device: int | None = None) -> None:
        self.backend, self.device = backend, device
        self._renderer: Renderer | None = None
        self._files: OrderedDict[Any, SceneFile] = OrderedDict()
        # The last scene as its file has it, the film's changes, and it on the changed film: still frames share one.
        self._filmed: tuple[Scene, Any, Scene] | None = None

    def close(self) -> None:
        """Gives the context back."""
        if self._renderer is not None:
            self._renderer.release()
            self._renderer = None

    @property
    def renderer(self) -> Renderer:
        """Errors: ContextError."""
        if self._renderer is None:
            from glshade.gl.renderer import Renderer

            self._renderer = Renderer(self.backend, self.device)
        return self._renderer

    @property
    def driver(self) -> str:
        """What draws, in the driver's words. Errors: ContextError."""
        return f"{self.renderer.context.renderer}; {self.renderer.context.version}"

    def make(self, task: Task) -> Record:
        """Draws and writes. What fails by a fault of FAULTS gives a record that says so."""
        drawn = self.draw(task)
        return drawn if isinstance(drawn, Record) else drawn.write()

    def draw(self, task: Task, scene: Scene | None = None) -> Drawn | Record:
        """The picture in memory; or a record, where there is nothing to write: it failed, or task.resume finds it in its file.

        scene: the task's, where the caller has it already.
        """
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            try:
                found = self._draw(task, scene)
            except FAULTS as error:
                found = _failed(task, error)
        said = tuple(dict.fromkeys(str(warning.message) for warning in heard))
        return replace(found, warnings=said) if said else found

    def _draw(self, task: Task, scene: Scene | None) -> Drawn | Record:
        begun = perf_counter()
        if scene is None:
            scene = self.scene(task)
        driver = "float64 reference" if task.reference else self.driver
        name = digest(scene, task, driver)
        made = Record(task.number, task.output, "done", name, driver=driver, device=self.device)
        if task.resume and all(digest_of(file) == name for file in _files(task, scene)):
            return replace(made, state="skipped", **_contents(task.output))
        loaded, started = perf_counter(), time()
        picture = self._picture(task, scene)
        seconds = {"load": loaded - begun, "draw": perf_counter() - loaded}
        return Drawn(picture, replace(made, seconds=seconds, started=started))

    def _picture(self, task: Task, scene: Scene) -> Image | Layers:
        linear = Path(task.output).suffix.lower() in FLOAT_SUFFIXES
        shading = cast(Any, task.shading)
        if task.reference:
            from glshade.image.view import shown
            from glshade.reference import render

            if scene.film.aovs:
                raise SceneError(f"{task.scene}: film.aovs: the reference draws the picture alone, without layers")
            image = render(scene, shading=shading)
            return image if linear else shown(image, scene.film)
        draw = self.renderer.layers if scene.film.aovs else self.renderer.render
        return draw(scene, dtype="float32" if linear else "uint8", shading=shading, tile=task.tile)

    def scene(self, task: Task) -> Scene:
        """The scene that a task draws. Errors: SceneError."""
        key = task.scene, task.overrides
        file = self._files.pop(key, None) or SceneFile(task.scene, task.overrides)
        self._files[key] = file
        if len(self._files) > KEPT_FILES:
            self._files.popitem(last=False)
        written = file.scene(task.frame, task.camera)
        changes = dict(task.film), task.settings
        if self._filmed is None or self._filmed[0] is not written or self._filmed[1] != changes:
            self._filmed = written, changes, _changed(written, task)
        return self._filmed[2]


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture that is drawn and not yet written."""

    picture: Image | Layers
    record: Record
    warnings: tuple[str, ...] = ()

    def write(self) -> Record:
        """Writes the file, on any thread. A file that cannot be written gives a record that says so."""
        record = replace(self.record, warnings=self.warnings)
        begun = perf_counter()
        path = Path(record.output)
        try:
            self.picture.save(path, {ATTRIBUTE: record.digest})
            contents = _contents(path)
        except FAULTS as error:
            place = _fault_of_place(path, self._size)
            # What the writer of a format says of a full disk, if anything, is less clear.
            message = f"{path}: cannot be written: {place}" if place and path.parent.is_dir() else str(error)
            code = getattr(error, "exit_code", 1)
            return replace(record, state="failed", error=message, exit_code=code, stops=bool(place))
        return replace(record, seconds={**record.seconds, "write": perf_counter() - begun}, finished=time(), **contents)

    @property
    def _size(self) -> int:
        """About how large the file may become [bytes]."""
        image = self.picture if isinstance(self.picture, Image) else self.picture.image
        return image.pixels.nbytes


def _changed(scene: Scene, task: Task) -> Scene:
    """The scene on the task's film and at its settings. Errors: SceneError."""
    if task.film:
        try:
            film = Film.model_validate({**scene.film.model_dump(), **task.film})
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise SceneError(f"{task.scene}: film.{'.'.join(map(str, first['loc']))}: {first['msg']}") from None
        scene = scene.model_copy(update={"film": film})
    if task.settings is not None:
        from glshade.tradeoff.budget import applied
        from glshade.tradeoff.setting import Setting

        scene = applied(scene, tuple(Setting(**setting) for setting in task.settings))
    return scene


def _files(task: Task, scene: Scene) -> list[Path]:
    """What there is where the picture is done."""
    output = Path(task.output)
    if not scene.film.aovs or output.suffix.lower() == ".exr":
        return [output]
    from glshade.image.layers import beside

    return [output, beside(output)]


def _failed(task: Task, error: BaseException) -> Record:
    message = str(error) or type(error).__name__
    if isinstance(error, OSError) and error.filename:
        message = f"{error.filename}: {error.strerror}"
    elif isinstance(error, MemoryError):
        message = f"{task.output}: there is not enough memory"
    return Record(task.number, task.output, "failed", error=message, exit_code=getattr(error, "exit_code", 1))


def _contents(path: str | Path) -> dict[str, Any]:
    """A file's hash and size."""
    data = Path(path).read_bytes()
    return {"sha256": hashlib.sha256(data).hexdigest(), "size": len(data)}


def _fault_of_place(path: Path, size: int) -> str:
    """Why the folder takes no file of about this size [bytes], or nothing: whether the next picture fails by the same."""
    try:
        with TemporaryFile(dir=path.parent) as file:
            file.write(bytes(min(size, MOST_PROBED)))
    except OSError as error:
        return error.strerror or str(error)
    return ""
