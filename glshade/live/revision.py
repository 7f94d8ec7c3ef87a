"""Revision: a scene with everything that its picture depends on, as it was when it was read.

A revision can be drawn from any camera although its files have changed or vanished since: it holds its meshes and its shader
files in memory, and its textures are copies.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from glshade.brdfs import Brdf
from glshade.errors import SceneError
from glshade.gl.renderer import Renderer
from glshade.glsl.shaders import Shaders
from glshade.limits import DEFAULT
from glshade.live.faults import FAULTS
from glshade.live.messages import Load
from glshade.mesh.model import MeshPart, Model
from glshade.scene.file import SceneFile
from glshade.scene.film import Film
from glshade.scene.models import glsl_models, use_glsl_models, use_models, use_shader_models
from glshade.scene.override import split
from glshade.scene.scene import Scene
from glshade.textures.texture import Picture

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Revision:
    """A scene with everything that its picture depends on.

    number: its number; a later one is larger.
    path: the scene file, or the mesh file.
    digest: the SHA-256 of its bytes.
    document: the table that the scene was made from, with the values of `--set`.
    scene: the scene. Its textures are copies, and it holds the contents of its mesh files.
    shaders: the shader files.
    copies: texture file -> its copy.
    files: the paths of all files that it was made from.
    models: the user's model folders.
    glsl_models: the files of the models without a reference, each with its text.
    """

    number: int
    path: Path
    digest: str
    document: Mapping[str, Any]
    scene: Scene
    shaders: Shaders
    copies: Mapping[Path, Path]
    files: tuple[Path, ...]
    models: tuple[Path, ...]
    glsl_models: Mapping[Path, bytes]

    def draw_with(self, renderer: Renderer) -> None:
        """Makes a renderer draw with the shaders and models of this revision, whatever the files hold now."""
        renderer.shaders = self.shaders
        use_glsl_models(self.glsl_models)


class Copies:
    """A folder with copies of texture files. A file that has not changed since its last copy is not copied again."""

    def __init__(self, folder: Path) -> None:
        """folder: the folder, which is made if need be."""
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        # (path, modification time [ns], size [bytes], inode) -> the copy.
        self._copies: dict[tuple[Path, int, int, int], Path] = {}
        self._number = 0
        # Models with pictures -> the same models with the copies in their place, so that equal revisions share their meshes.
        self._models: dict[Model, tuple[dict[Path, Path], Model]] = {}

    def copy(self, path: Path) -> Path:
        """Returns the copy of a file as it is now. Errors: SceneError."""
        try:
            stat = path.stat()
            key = path, stat.st_mtime_ns, stat.st_size, stat.st_ino
            if key not in self._copies:
                self._number += 1
                copy = self._folder / f"{self._number}{path.suffix}"
                shutil.copyfile(path, copy)
                self._copies[key] = copy
            return self._copies[key]
        except OSError as error:
            raise SceneError(f"{path}: cannot be read: {error.strerror}") from None

    def model(self, model: Model, copies: dict[Path, Path]) -> Model:
        """Returns a model whose materials name copies of their textures; the same object if nothing has changed.

        copies: texture file -> its copy; the model's textures are added.
        Errors: SceneError.
        """
        found: dict[Path, Path] = {}

        def copied(path: Path) -> Path:
            found[path] = self.copy(path)
            return found[path]

        parts = tuple(_part(part, copied) for part in model.parts)
        copies |= found
        if not found:
            return model
        known = self._models.get(model)
        if known is None or known[0] != found:
            self._models[model] = known = found, replace(model, parts=parts)
        return known[1]

    def keep(self, *revisions: Revision) -> None:
        """Deletes the copies that none of these revisions needs."""
        needed = {copy for revision in revisions for copy in revision.copies.values()}
        for key, copy in list(self._copies.items()):
            if copy not in needed:
                del self._copies[key]
                copy.unlink(missing_ok=True)
        used = {id(model) for revision in revisions for model in (revision.scene.models or {}).values()}
        self._models = {model: entry for model, entry in self._models.items() if id(entry[1]) in used}


def read(request: Load, copies: Copies) -> Revision:
    """Reads the files of a revision.

    Errors: ExceptionGroup of the errors (GlshadeError, OSError) of the shader folders and of the scene.
    """
    errors: list[Exception] = []
    shaders = _tried(errors, lambda: _shaders(request))
    revision = _tried(errors, lambda: _read(request, copies, shaders))
    if errors or revision is None:
        raise ExceptionGroup(request.scene, errors)
    return revision


def _tried(errors: list[Exception], step: Callable[[], Result]) -> Result | None:
    """Returns the result of a step of reading; None where it fails, which adds its error."""
    try:
        return step()
    except FAULTS as error:
        errors.append(error)
        return None


def _shaders(request: Load) -> Shaders:
    """Returns the shader files, all those of the user's folders read. Errors: ShaderError, SceneError."""
    use_models(request.models)
    use_shader_models(request.shaders)
    shaders = Shaders(request.shaders)
    shaders.read_own()
    return shaders


def _read(request: Load, copies: Copies, shaders: Shaders | None) -> Revision | None:
    """Returns the revision; None where there are no shaders. Errors: SceneError."""
    path = Path(request.scene)
    overrides = [split(text) for text in request.overrides]
    if request.size is not None:
        overrides.append(("film.size", str(list(request.size))))
    # The digest is taken first: if the file changes in between, values are not written back to it.
    digest = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    file = SceneFile(path, overrides, DEFAULT)
    scene = file.scene()
    if shaders is None:
        return None
    copied: dict[Path, Path] = {}
    models = {
        item.mesh: copies.model(scene.loader()(item.mesh), copied) for item in scene.objects if isinstance(item.mesh, Path)
    }
    files = {path, *(file for model in models.values() for file in model.stamps)}

    def copy(texture: Path) -> Path:
        files.add(texture)
        copied[texture] = copies.copy(texture)
        return copied[texture]

    scene = with_pictures(scene, copy).with_models(models)
    return Revision(
        request.revision,
        path,
        digest,
        file.document,
        scene,
        shaders,
        copied,
        tuple(sorted(files)),
        tuple(map(Path, request.models)),
        glsl_models(),
    )


def with_film(scene: Scene, **values: Any) -> Scene:
    """Returns the scene with other values of its film. Errors: SceneError."""
    try:
        film = Film.model_validate({**scene.film.model_dump(), **values})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise SceneError(f"film.{'.'.join(map(str, first['loc']))}: {first['msg']}") from None
    excess = film.excess(scene.limits)
    if excess:
        raise SceneError(f"film: {excess}")
    return scene.model_copy(update={"film": film})


def with_pictures(scene: Scene, copy: Callable[[Path], Path]) -> Scene:
    """Returns the scene with other files for its textures. copy: file -> the file in its place."""
    materials = {name: _material(material, copy) for name, material in scene.materials.items()}
    objects = tuple(
        item.model_copy(update={"material": _material(item.material, copy)}) if isinstance(item.material, Brdf) else item
        for item in scene.objects
    )
    return scene.model_copy(update={"materials": materials, "objects": objects})


def _material(material: Any, copy: Callable[[Path], Path]) -> Any:
    """Returns a material with other files for its textures and tables; the same object where it has none."""
    assert isinstance(material, Brdf)
    pictures = {name: getattr(material, name) for name in type(material).model_fields}
    changed: dict[str, Any] = {
        name: picture.model_copy(update={"texture": copy(picture.texture)})
        for name, picture in pictures.items()
        if isinstance(picture, Picture) and isinstance(picture.texture, Path)
    }
    changed |= {key: copy(path) for key in material.tables.values() if isinstance(path := getattr(material, key), Path)}
    return material.model_copy(update=changed) if changed else material


def _part(part: MeshPart, copy: Callable[[Path], Path]) -> MeshPart:
    """Returns a part of a mesh file with other files for the textures of its material."""
    material: dict[str, Any] = {}
    for key, value in (part.material or {}).items():
        picture = isinstance(value, Mapping) and "texture" in value
        material[key] = {**value, "texture": str(copy(Path(value["texture"])))} if picture else value
    return replace(part, material=material) if part.material else part
