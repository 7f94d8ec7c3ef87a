"""Scene files: TOML, JSON of the same shape, or a bare mesh, which is a scene too."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from glshade.document import Document, nearest
from glshade.errors import AssetError, SceneError
from glshade.image.file import probe
from glshade.mesh import file as mesh_file
from glshade.scene.scene import Scene
from glshade.textures.texture import Picture

if TYPE_CHECKING:
    from glshade.scene.override import Overrides

TEXT_SUFFIXES = (".toml", ".json")


def load(path: str | Path, overrides: Overrides = ()) -> Scene:
    """The scene in a file, with its meshes read.

    A mesh file is framed by a camera, lit by the default rig and drawn in its own material. overrides: values in place of the
    file's, in their order, by dotted keys such as "materials.body.roughness" or "objects.ball.shading"; or pairs of key and
    text, as `--set KEY=VALUE` has them. Errors: SceneError with every fault: file, key path, what is allowed.
    """
    return SceneFile(path, overrides).scene()


class SceneFile:
    """A scene as it is written, to be taken at any frame and through any of its cameras.

    Errors: SceneError, for what cannot be read, and for overrides that lead nowhere.
    """

    def __init__(self, path: str | Path, overrides: Overrides = ()) -> None:
        self.path = Path(path)
        suffix = self.path.suffix.lower()
        if suffix in mesh_file.SUFFIXES:
            mesh_file.load(self.path)
            # Its name is the key to it; what is absolute needs no folder.
            mesh = {"name": self.path.stem, "mesh": str(self.path.resolve())}
            document: Any = {"description": self.path.name, "objects": [mesh], "film": {"samples": 4, "background": BACKDROP}}
        elif suffix in TEXT_SUFFIXES:
            document = _read(self.path)
        else:
            known = ", ".join([*TEXT_SUFFIXES, *sorted(mesh_file.SUFFIXES)])
            raise SceneError(f"{self.path}: {suffix or 'no extension'} is neither a scene nor a mesh; known: {known}")
        self.document = _overridden(document, overrides, self.path)
        self._as_written = self.document is document
        # Textures' files that could be read, and the last scene whose files all could.
        self._probed: set[Path] = set()
        self._checked: Scene | None = None
        # By camera: the last scene, and it through that camera.
        self._seen: dict[str, tuple[Scene, Scene]] = {}

    @cached_property
    def _written(self) -> Scene:
        """The scene as it is written."""
        return parse(self.document, self.path)

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of its cameras."""
        return tuple(self._written.cameras)

    def scene(self, frame: float | None = None, camera: str | None = None) -> Scene:
        """The scene at a frame, as it is written where that is None, through one of its cameras.

        Errors: SceneError with every fault; those that the file alone does not have say that they came with --set.
        """
        try:
            return self._scene(frame, camera)
        except SceneError as error:
            if self._as_written:
                raise
            own: tuple[str, ...] = ()
            try:
                SceneFile(self.path)._scene(frame, camera)
            except SceneError as written:
                own = written.problems
            raise SceneError([fault if fault in own else f"{fault} (from --set)" for fault in error.problems]) from None

    def _scene(self, frame: float | None, camera: str | None) -> Scene:
        scene = self._written if frame is None else self._at(frame)
        if camera is not None:
            if camera not in self.cameras:
                raise SceneError(f'{self.path}: no camera is named "{camera}"{nearest(camera, self.cameras)}')
            scene = self._through(camera, scene)
        self._check(scene)
        return scene

    def _at(self, frame: float) -> Scene:
        """The scene at a frame: what its tracks leave alone is not validated again, and stays the same object."""
        written = self._written
        if not written.animation:
            return written
        from glshade.scene.animation import at_frame
        from glshade.scene.override import OverrideError

        try:
            document = at_frame(self.document, written.animation, frame)
        except OverrideError as error:
            raise SceneError(f"{self.path}: animation: {error}") from None
        return parse(_merged(written, self.document, document), self.path)

    def _through(self, camera: str, scene: Scene) -> Scene:
        """The scene seen by one of its cameras; the same object for the same scene."""
        if camera not in self._seen or self._seen[camera][0] is not scene:
            self._seen[camera] = scene, scene.model_copy(update={"camera": scene.cameras[camera]})
        return self._seen[camera][1]

    def _check(self, scene: Scene) -> None:
        """Looks at the files that the scene names: meshes always, textures where they are new."""
        problems: list[str] = []
        meshes: dict[Path, tuple[str, ...]] = {}
        for index, item in enumerate(scene.objects):
            if not isinstance(item.mesh, Path):
                continue
            if item.mesh not in meshes:
                meshes[item.mesh] = _faults(item.mesh)
            problems.extend(f"{self.path}: objects[{index}].mesh: {problem}" for problem in meshes[item.mesh])
        for place, picture in _pictures(scene, self._checked):
            if picture in self._probed:
                continue
            try:
                probe(picture)
                self._probed.add(picture)
            except AssetError as error:
                problems.append(f"{self.path}: {place}: {error}")
        if problems:
            raise SceneError(problems)
        self._checked = scene


def _faults(mesh: Path) -> tuple[str, ...]:
    """What is wrong with a mesh's file."""
    try:
        mesh_file.load(mesh)
    except SceneError as error:
        return error.problems
    return ()


def _merged(written: Scene, before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """`after`, with what it shares with `before` as it was validated in `written`."""
    merged: dict[str, Any] = {}
    for key, value in after.items():
        known, old = getattr(written, key), before.get(key)
        if value is old:
            merged[key] = known
        elif isinstance(value, list) and isinstance(old, list):
            merged[key] = [k if new is o else new for k, new, o in zip(known, value, old, strict=True)]
        elif key in ("materials", "cameras") and isinstance(old, Mapping):
            merged[key] = {name: known[name] if new is old.get(name) else new for name, new in value.items()}
        else:
            merged[key] = value
    return merged


def _overridden(document: Any, overrides: Overrides, path: Path) -> Any:
    """The same document where there is nothing to override. Errors: SceneError for a key that leads nowhere."""
    # What is no table is a fault of the file, and reported as such.
    if not overrides or not isinstance(document, Mapping):
        return document
    from glshade.scene.override import OverrideError, apply, pairs

    try:
        values = pairs(overrides)
    except ValueError as error:
        raise SceneError(f"{path}: --set {error}") from None
    problems = []
    for key, value in values:
        try:
            document = apply(document, key, value)
        except OverrideError as error:
            problems.append(f"{path}: --set {error}")
    if problems:
        raise SceneError(problems)
    return document


def _pictures(scene: Scene, known: Scene | None) -> Iterator[tuple[str, Path]]:
    """(key path, file) of every texture of the materials that `known` has not."""
    seen = {id(material) for _, material in _materials(known)} if known else set()
    for place, material in _materials(scene):
        if isinstance(material, Document) and id(material) not in seen:
            for name in type(material).model_fields:
                value = getattr(material, name)
                if isinstance(value, Picture):
                    yield f"{place}.{name}.texture", value.texture


def _materials(scene: Scene) -> Iterator[tuple[str, Any]]:
    """(key path, material) of all that the scene lists, and all that its objects have of their own."""
    yield from ((f"materials.{name}", material) for name, material in scene.materials.items())
    yield from ((f"objects[{index}].material", item.material) for index, item in enumerate(scene.objects))


# Behind a bare mesh: a dark grey that light and dark objects both stand out from.
BACKDROP = (0.05, 0.055, 0.065)


def parse(data: Any, path: Path) -> Scene:
    """The scene of a table; relative files start at the folder of `path`. Errors: SceneError with every fault."""
    try:
        return Scene.model_validate(data, context={"folder": path.parent.resolve()})
    except ValidationError as error:
        raise SceneError([f"{path}: {_key_path(e['loc'])}{e['msg']}" for e in error.errors(include_url=False)]) from None


def _read(path: Path) -> Any:
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"{path}: there is no such file") from None
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: is not UTF-8 text (byte {error.start})") from None
    try:
        return tomllib.loads(text) if path.suffix.lower() == ".toml" else json.loads(text)
    except (tomllib.TOMLDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise SceneError(f"{path}: is not {path.suffix[1:].upper()}: {error}") from None


def _key_path(loc: tuple[str | int, ...]) -> str:
    """`objects[2].material.kd: `"""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc)
    return text.lstrip(".") + ": " if text else ""
