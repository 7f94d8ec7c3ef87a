"""Maker: makes the pictures of tasks, and keeps the context, scene files and compiled programs for the next task."""

from __future__ import annotations

import filecmp
import hashlib
import json
import warnings
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from time import perf_counter, time
from typing import TYPE_CHECKING, Any, cast

from pydantic import ValidationError

from glshade.batch.digest import ATTRIBUTE, code_digest, digest_of, picture_digest
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import GlshadeError, SceneError
from glshade.image.file import format_of
from glshade.image.image import Image
from glshade.limits import Limits
from glshade.scene.file import SceneFile
from glshade.scene.film import Film
from glshade.scene.models import Folders, paths, use_models, use_shader_models
from glshade.scene.scene import Scene

if TYPE_CHECKING:
    from glshade.gl.context import Backend
    from glshade.gl.renderer import Renderer
    from glshade.image.layers import Layers

# Errors that are not bugs in glshade. They become failed records.
FAULTS = (GlshadeError, OSError, MemoryError)
# Capacity of the LRU cache of scene files. A small one is enough: a sweep has an entry for each of its values, but uses one
# entry after another.
KEPT_FILES = 16
# Largest size of the temporary file that is written to test whether a folder has room for a picture [bytes].
MOST_PROBED = 64 << 20


class Maker:
    """Makes pictures with one OpenGL context, which is opened when it is first needed.

    An OpenGL context belongs to the thread that uses it first, so all methods of a Maker must be called from one thread. Only
    `Drawn.write` may be called from another thread.
    """

    def __init__(
        self,
        backend: Backend = "auto",
        device: int | None = None,
        shaders: Folders | None = None,
        models: Folders | None = None,
    ) -> None:
        """Takes the arguments of Renderer. Errors: SceneError and ShaderError for the user's own models."""
        use_models(models)
        use_shader_models(shaders)
        self.backend, self.device, self.shaders = backend, device, paths(shaders)
        self._renderer: Renderer | None = None
        self._files: OrderedDict[Any, SceneFile] = OrderedDict()
        # A cache of one entry: the last scene from a file, the task's changes to it, and the changed scene. So frames without
        # animation share one scene object, and the renderer prepares it only once.
        self._filmed: tuple[Scene, Any, Scene] | None = None

    def close(self) -> None:
        """Releases the context."""
        if self._renderer is not None:
            self._renderer.release()
            self._renderer = None

    @property
    def renderer(self) -> Renderer:
        """The renderer, which opens the context on first use. Errors: ContextError."""
        if self._renderer is None:
            from glshade.gl.renderer import Renderer

            self._renderer = Renderer(self.backend, self.device, shaders=self.shaders)
        return self._renderer

    @property
    def driver(self) -> str:
        """OpenGL's renderer and version, as the driver reports them. Errors: ContextError."""
        return f"{self.renderer.context.renderer}; {self.renderer.context.version}"

    @property
    def code(self) -> str:
        """The digest of the code, as `code_digest` returns it. Errors: ShaderError."""
        return code_digest(self.shaders)

    def make(self, task: Task) -> Record:
        """Draws and writes a picture. An error of FAULTS is not raised but returned as a failed record."""
        drawn = self.draw(task)
        return drawn if isinstance(drawn, Record) else drawn.write()

    def draw(self, task: Task, scene: Scene | None = None) -> Drawn | Record:
        """Draws a picture into memory.

        Returns a record instead if there is nothing to write: the picture failed, or task.resume is set and the file holds the
        picture already.
        task: the picture to draw
        scene: the scene of the task, if the caller has loaded it already
        """
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                result = self._draw(task, scene)
            except FAULTS as error:
                result = _failed(task, error)
        messages = tuple(dict.fromkeys(str(warning.message) for warning in caught))
        return replace(result, warnings=messages) if messages else result

    def _draw(self, task: Task, scene: Scene | None) -> Drawn | Record:
        start = perf_counter()
        if scene is None:
            scene = self.scene(task)
        driver = "float64 reference" if task.reference else self.driver
        name = picture_digest(scene, task, driver, self.code)
        sample = self._file(task).drawn(task.frame)
        record = Record(task.number, task.output, "done", name, driver=driver, device=self.device, sample=sample)
        files = _files(task, scene)
        if task.resume and task.known[:1] == (name,):
            kept = replace(record, state="skipped", **_contents(files))
            if kept.known == task.known:
                return kept
        loaded, started = perf_counter(), time()
        picture = self._picture(task, scene)
        seconds = {"load": loaded - start, "draw": perf_counter() - loaded}
        # The digest in a file's header says nothing about the rest of the file. So the file is compared with the new picture.
        compared = task.resume and all(digest_of(file) == name for file in files if file.suffix != ".json")
        image = picture if isinstance(picture, Image) else picture.image
        seen = json.loads(image.calibration.json()) if image.calibration else {}
        shown = self._instances(task, scene) if task.instances else {}
        record = replace(record, seconds=seconds, started=started, seen=seen, instances=shown)
        return Drawn(picture, files, record, compared)

    def _instances(self, task: Task, scene: Scene) -> dict[str, Any]:
        """Returns the objects that a picture shows. Errors: SceneError."""
        from glshade.batch.coco import instances

        if task.reference:
            raise SceneError(f"{task.scene}: the reference draws the picture alone, without masks of objects")
        return instances(scene, self.renderer.surfaces(scene)[1])

    def _picture(self, task: Task, scene: Scene) -> Image | Layers:
        linear = format_of(task.output).floats
        shading = cast(Any, task.shading)
        if task.reference:
            from glshade.image.view import displayed
            from glshade.reference.picture import render

            if scene.film.aovs:
                raise SceneError(f"{task.scene}: film.aovs: the reference draws the picture alone, without layers")
            image = render(scene, shading=shading)
            film = scene.film
            return image if linear else displayed(image, film.encoding, ocio=film.ocio, display=film.display, view=film.view)
        draw = self.renderer.layers if scene.film.aovs else self.renderer.render
        return draw(scene, dtype="float32" if linear else "uint8", shading=shading, tile=task.tile)

    def scene(self, task: Task) -> Scene:
        """Returns the scene that a task draws. Errors: SceneError."""
        original = self._file(task).scene(task.frame, task.camera)
        changes = dict(task.film), task.settings
        if self._filmed is None or self._filmed[0] is not original or self._filmed[1] != changes:
            self._filmed = original, changes, _changed(original, task)
        return self._filmed[2]

    def _file(self, task: Task) -> SceneFile:
        """Returns the scene file of a task with its overrides. Errors: SceneError."""
        key = task.scene, task.overrides, tuple(task.limits.items())
        file = self._files.pop(key, None) or SceneFile(task.scene, task.overrides, Limits(**task.limits))
        self._files[key] = file
        if len(self._files) > KEPT_FILES:
            self._files.popitem(last=False)
        return file


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture that is drawn and not yet written.

    picture: the pixels, with layers if the film asks for them
    files: the picture's file and the separate files of its layers
    record: the record of the picture, complete except for the fields about the file
    compared: True if files that hold the same bytes already are left alone; the record then says "skipped"
    warnings: messages of the warnings raised while it was drawn
    """

    picture: Image | Layers
    files: list[Path]
    record: Record
    compared: bool = False
    warnings: tuple[str, ...] = ()

    def write(self) -> Record:
        """Writes the file and returns the record. Any thread may call this; an error of FAULTS becomes a failed record."""
        record = replace(self.record, warnings=self.warnings)
        start = perf_counter()
        path = Path(record.output)
        try:
            if self.compared and self._is_there():
                return replace(record, state="skipped", **_contents(self.files))
            self.picture.save(path, {ATTRIBUTE: record.digest})
            contents = _contents(self.files)
        except FAULTS as error:
            fault = _fault_of_folder(path, self._size)
            # If the disk is full, the operating system's message is clearer than that of the library that writes the format.
            message = f"{path}: cannot be written: {fault}" if fault and path.parent.is_dir() else str(error)
            code = getattr(error, "exit_code", 1)
            return replace(record, state="failed", error=message, exit_code=code, stops=bool(fault))
        return replace(record, seconds={**record.seconds, "write": perf_counter() - start}, finished=time(), **contents)

    def _is_there(self) -> bool:
        """Returns whether the files hold the bytes that `save` would write; False where there is no room for a copy."""
        try:
            with TemporaryDirectory() as folder:
                copies = [Path(folder) / file.name for file in self.files]
                self.picture.save(copies[0], {ATTRIBUTE: self.record.digest})
                return all(filecmp.cmp(file, copy, shallow=False) for file, copy in zip(self.files, copies, strict=True))
        except (GlshadeError, OSError):
            return False

    @property
    def _size(self) -> int:
        """The size of the pixels in memory [bytes]. The file is hardly larger."""
        image = self.picture if isinstance(self.picture, Image) else self.picture.image
        return image.pixels.nbytes


def _changed(scene: Scene, task: Task) -> Scene:
    """Returns the scene with the task's film and settings. Errors: SceneError."""
    if task.film:
        try:
            film = Film.model_validate({**scene.film.model_dump(), **task.film})
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise SceneError(f"{task.scene}: film.{'.'.join(map(str, first['loc']))}: {first['msg']}") from None
        scene = scene.model_copy(update={"film": film})
    if task.settings is not None:
        from glshade.tradeoff.choice import applied
        from glshade.tradeoff.setting import Setting

        scene = applied(scene, tuple(Setting(**setting) for setting in task.settings))
    return scene


def _files(task: Task, scene: Scene) -> list[Path]:
    """Returns the files that a task writes: the picture, and the files of layers that lie beside it."""
    output = Path(task.output)
    if not scene.film.aovs:
        return [output]
    from glshade.image.layer_paths import layer_files

    return [output, *layer_files(output, scene.film.aovs, scene.film.aov_format)]


def _failed(task: Task, error: BaseException) -> Record:
    """Returns the record of a task that failed by this error."""
    message = str(error) or type(error).__name__
    if isinstance(error, OSError) and error.filename:
        message = f"{error.filename}: {error.strerror}"
    elif isinstance(error, MemoryError):
        message = f"{task.output}: there is not enough memory"
    return Record(task.number, task.output, "failed", error=message, exit_code=getattr(error, "exit_code", 1))


def _contents(files: Sequence[Path]) -> dict[str, Any]:
    """Returns the size of a picture's file and the hashes of all its files, as fields of a Record.

    The hash of a missing file is "".
    """
    hashes = [hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else "" for file in files]
    size = files[0].stat().st_size if hashes[0] else 0
    return {"sha256": hashes[0], "size": size, "layers_sha256": "".join(hashes[1:])}


def _fault_of_folder(path: Path, size: int) -> str:
    """Returns the reason why no file of about this size [bytes] can be written to the folder of `path`; "" if one can.

    If there is a reason, the next picture would fail for it too.
    """
    try:
        with TemporaryFile(dir=path.parent) as file:
            file.write(bytes(min(size, MOST_PROBED)))
    except OSError as error:
        return error.strerror or str(error)
    return ""
