"""Scene files: scenes that are read from TOML, from JSON with the same keys, or from a mesh file or a robot alone."""

from __future__ import annotations

import json
import math
import re
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from glshade.document import nearest
from glshade.errors import AssetError, AssetWarning, SceneError
from glshade.files import read_text
from glshade.image.file import probe
from glshade.limits import DEFAULT, LARGEST_SCENE, MOST_FAULTS, Limits
from glshade.mesh import file as mesh_file
from glshade.mesh.model import Model
from glshade.scene import checking, joints, of_files, up
from glshade.scene.models import Folders, use_models, use_shader_models
from glshade.scene.scene import Scene

if TYPE_CHECKING:
    from glshade.scene.override import Overrides

TEXT_SUFFIXES = (".toml", ".json")
# A dotted key of more than 64 parts, for which Python's parser of TOML takes time that grows with the square of their number.
LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){64}""")


def load(
    path: str | Path,
    overrides: Overrides = (),
    *,
    models: Folders | None = None,
    shaders: Folders | None = None,
    allow_outside: bool = False,
    limits: Limits = DEFAULT,
) -> Scene:
    """Returns the scene in a file, and reads its meshes.

    For a mesh file alone, a default camera and the default lights are chosen, and the materials are the mesh file's own. So it
    is for a robot (.urdf), whose links become objects.
    path: a scene file, a mesh file or a robot's file.
    overrides: values that replace those of the file, in their order: a table of dotted keys such as "materials.body.roughness"
        or "objects.ball.shading"; or pairs of key and text, as in `--set KEY=VALUE`. For a mesh file, "up" names the axis that
        points up: "x", "y", "z", or "auto" (z for .stl, else y). For a robot, "joints.NAME" is the value of a joint.
    models: a folder, or several, with reflectance models and lights of the user's own.
    shaders: a shader folder, or several, whose files brdf/NAME.glsl may be reflectance models.
    allow_outside: whether mesh files may name textures, materials and buffers outside their folder and the folders that the
        scene names. docs/security.md explains it.
    limits: the largest numbers of triangles and pixels.
    Errors: SceneError with every fault, each with the file, the key path and the values that are allowed; ShaderError for a
    reflectance model whose GLSL struct cannot be understood.
    """
    use_models(models)
    use_shader_models(shaders)
    limits = replace(limits, allow_outside=limits.allow_outside or allow_outside)
    return SceneFile(path, overrides, limits).scene()


class SceneFile:
    """A scene file, which returns its scene at any frame and through any of its cameras."""

    def __init__(self, path: str | Path, overrides: Overrides = (), limits: Limits = DEFAULT) -> None:
        """Reads the file. path, overrides and limits: as for `load`.

        Errors: SceneError for a file that cannot be read, and for overrides whose keys name no value.
        """
        self.path, self.limits, self._overrides = Path(path), limits, overrides
        suffix = self.path.suffix.lower()
        if suffix != joints.SUFFIX:
            overrides = joints.refuse(self.path, overrides)
        if suffix in mesh_file.SUFFIXES:
            mesh_file.load(self.path, limits)
            # Overrides find the object by its name. The path is absolute, so that it is right from any folder.
            mesh: dict[str, Any] = {"name": self.path.stem, "mesh": str(self.path.resolve())}
            rotate, overrides = up.turn(self.path, overrides)
            if any(rotate):
                mesh["transform"] = {"rotate": rotate}
            document: Any = {"description": self.path.name, "objects": [mesh], "film": FILM}
        elif suffix in TEXT_SUFFIXES:
            up.refuse(self.path, overrides)
            document = _read(self.path)
        elif suffix == joints.SUFFIX:
            from glshade.scene import robot

            up.refuse(self.path, overrides)
            positions, overrides = joints.split(overrides, self.path)
            document = {**robot.document(self.path, positions, limits), "film": FILM}
            _refuse([(loc, message) for loc, message in checking.faults(document)], self.path)
        else:
            known = ", ".join([*TEXT_SUFFIXES, joints.SUFFIX, *sorted(mesh_file.SUFFIXES)])
            raise SceneError(f"{self.path}: {suffix or 'no extension'} is neither a scene nor a mesh; known: {known}")
        document, overrides = of_files.chosen(document, overrides)
        values = _values(overrides, self.path)
        self.document = _overridden(document, values, self.path)
        self._as_written = self.document is document
        self._of_camera = [(key, value) for key, value in values if key.startswith("camera.")]
        # The texture files that are known to be readable.
        self._probed: set[Path] = set()
        # The last scene whose files were all readable.
        self._checked: Scene | None = None
        # The mesh files of the last scene that was checked. This keeps them in memory from frame to frame, whatever their size.
        self._models: dict[Path, Model] = {}
        # name of a further camera -> (the last scene that was asked for with it, the same scene with this camera).
        self._seen: dict[str, tuple[Scene, Scene]] = {}

    @cached_property
    def _written(self) -> Scene:
        """The scene without its animation. Errors: SceneError."""
        return parse(self.document, self.path, self.limits)

    @cached_property
    def _other(self) -> SceneFile:
        """The same file without the overrides of `camera.*`, which belong to the further camera that the scene is seen through.

        Such a camera may have keys that the scene's own camera has not. Errors: SceneError.
        """
        if not self._of_camera:
            return self
        given = self._overrides
        pairs = given.items() if isinstance(given, Mapping) else given
        kept = [(key, value) for key, value in pairs if not key.startswith("camera.")]
        return SceneFile(self.path, dict(kept) if isinstance(given, Mapping) else kept, self.limits)

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the scene's further cameras, and those of the cameras in its mesh files. Errors: SceneError."""
        written = self._other._written
        return tuple({**of_files.file_cameras(written, written.loader()), **written.cameras})

    def scene(self, frame: float | None = None, camera: str | None = None) -> Scene:
        """Returns the scene.

        frame: the frame of the animation; None: the scene without its animation.
        camera: the name of one of the scene's further cameras, or of a camera in a mesh file; None: the scene's own camera.
        Errors: SceneError with every fault. A fault that the file has only with the overrides is marked "(from --set)".
        """
        try:
            return self._scene(frame, camera)
        except SceneError as error:
            if self._as_written:
                raise
            own: tuple[str, ...] = ()
            try:
                SceneFile(self.path, limits=self.limits)._scene(frame, camera)
            except SceneError as written:
                own = written.problems
            raise SceneError([fault if fault in own else f"{fault} (from --set)" for fault in error.problems]) from None

    def _scene(self, frame: float | None, camera: str | None) -> Scene:
        file = self if camera is None else self._other
        scene = file._written if frame is None else file._at(frame)
        # The mesh files are read first, because they may hold the camera.
        file._check(scene)
        if camera is None:
            return scene
        if camera not in scene.cameras and camera not in self.cameras:
            raise SceneError(f'{self.path}: no camera is named "{camera}"{nearest(camera, self.cameras)}')
        return self._through(camera, scene)

    def _at(self, frame: float) -> Scene:
        """Returns the scene at a frame. Values that no track changes are not validated again and stay the same objects."""
        written = self._written
        if not written.animation and written.sample is None:
            return written
        return parse(merged(written, self.document, self.document_at(frame)), self.path, self.limits)

    def document_at(self, frame: float) -> dict[str, Any]:
        """Returns the table of the scene at a frame: its sample is drawn, and its animation is applied.

        Errors: SceneError for a key that names no value.
        """
        from glshade.scene.animation import at_frame
        from glshade.scene.override import OverrideError
        from glshade.scene.sampling import at_sample

        written, part, document = self._written, "sample", dict(self.document)
        try:
            if written.sample is not None:
                document = at_sample(document, written.sample, math.floor(frame))
            part = "animation"
            return at_frame(document, written.animation, frame)
        except OverrideError as error:
            raise SceneError(f"{self.path}: {part}: {error}") from None

    def drawn(self, frame: float | None) -> dict[str, Any]:
        """Returns the values of the sample that is drawn at a frame, by their dotted keys; empty without a sample."""
        sample = self._other._written.sample
        return {} if sample is None or frame is None else sample.drawn(math.floor(frame))

    def _through(self, camera: str, scene: Scene) -> Scene:
        """Returns the scene with one of its further cameras; the same object for the same scene."""
        if camera not in self._seen or self._seen[camera][0] is not scene:
            view = scene.cameras.get(camera) or of_files.file_cameras(scene, scene.loader())[camera]
            self._seen[camera] = scene, self._overridden_camera(scene.through(view))
        return self._seen[camera][1]

    def _overridden_camera(self, scene: Scene) -> Scene:
        """Returns the scene with the overrides of `camera.*` in the camera through which it is seen, whatever its name.

        Errors: SceneError.
        """
        if not self._of_camera:
            return scene
        from glshade.scene.override import apply

        document: Mapping[str, Any] = {"camera": scene.camera.model_dump(exclude_unset=True)}
        for key, value in self._of_camera:
            document = apply(document, key, value)
        # The other values are validated already, and so are the cameras of another file.
        known = {key: getattr(scene, key) for key in Scene.model_fields if key != "cameras_from"}
        return parse({**known, **document}, self.path, self.limits)

    def _check(self, scene: Scene) -> None:
        """Reads the mesh files that the scene names, and the headers of texture files that are new. Errors: SceneError."""
        problems: list[str] = []
        models: dict[Path, Model] = {}
        faults: dict[Path, tuple[str, ...]] = {}
        load = scene.loader()
        for index, item in enumerate(scene.objects):
            if not isinstance(item.mesh, Path):
                continue
            if item.mesh not in models and item.mesh not in faults:
                try:
                    models[item.mesh] = load(item.mesh)
                except SceneError as error:
                    faults[item.mesh] = error.problems
            problems.extend(f"{self.path}: objects[{index}].mesh: {problem}" for problem in faults.get(item.mesh, ()))
        self._models = models
        for place, picture in scene.pictures(self._checked):
            path = picture.texture
            if not isinstance(path, Path) or path in self._probed:
                continue
            try:
                probe(path)
                self._probed.add(path)
            except AssetError as error:
                problems.append(f"{self.path}: {place}: {error}")
        for place, material, name in scene.tables(self._checked):
            try:
                material.table(name)
            except AssetError as error:
                problems.extend(f"{self.path}: {place}: {problem}" for problem in error.problems)
        if problems:
            raise SceneError(problems)
        if self._checked is None:
            for line in of_files.remarks(scene, models):
                warnings.warn(line, AssetWarning, stacklevel=2)
        self._checked = scene


def merged(written: Scene, before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the table `after`, with validated values in place of those that it shares with the table `before`.

    written: the scene that was validated from `before`.
    """
    merged: dict[str, Any] = {}
    for key, value in after.items():
        # An override may add a key that no scene has; it is refused later.
        known: Any = getattr(written, key, None)
        old = before.get(key)
        if value is old:
            merged[key] = known
        elif isinstance(value, list) and isinstance(old, list):
            merged[key] = [k if new is o else new for k, new, o in zip(known, value, old, strict=True)]
        elif key in ("materials", "cameras") and isinstance(old, Mapping):
            merged[key] = {name: known[name] if new is old.get(name) else new for name, new in value.items()}
        else:
            merged[key] = value
    return merged


def _values(overrides: Overrides, path: Path) -> list[tuple[str, Any]]:
    """Returns the keys and values of overrides. Errors: SceneError for a text that is not a value."""
    if not overrides:
        return []
    from glshade.scene.override import pairs

    try:
        return pairs(overrides)
    except ValueError as error:
        raise SceneError(f"{path}: --set {error}") from None


def _overridden(document: Any, values: Sequence[tuple[str, Any]], path: Path) -> Any:
    """Returns the document with values in place of its own; the same object where there are none.

    Errors: SceneError for every key that names no value.
    """
    # A document that is not a table is reported later, as a fault of the file.
    if not values or not isinstance(document, Mapping):
        return document
    from glshade.scene.override import OverrideError, apply

    problems = []
    for key, value in values:
        try:
            document = apply(document, key, value)
        except OverrideError as error:
            problems.append(f"{path}: --set {error}")
    if problems:
        raise SceneError(problems)
    _refuse([fault for key, value in values for fault in checking.faults({key: value})], path)
    return document


# The film of a scene that is a mesh file alone. From its dark grey background light and dark objects both stand out. Single
# points of one pixel would hardly be seen on it, so they are twice as wide.
FILM = {"samples": 4, "background": (0.05, 0.055, 0.065), "point_size": 2.0}


def parse(data: Any, path: Path, limits: Limits = DEFAULT) -> Scene:
    """Returns the scene that a table describes.

    data: the table, as read from a file.
    path: the scene file, which messages name; the paths in the table are relative to its folder.
    limits: the limits of the scene.
    Errors: SceneError with every fault.
    """
    try:
        return Scene.model_validate(data, context={"folder": path.parent.resolve(), "limits": limits})
    except ValidationError as error:
        found = error.errors(include_url=False, include_context=False, include_input=False)
        _refuse([(e["loc"], e["msg"]) for e in found], path)
        raise


def _read(path: Path) -> Any:
    """Returns the content of a TOML or JSON file. Errors: SceneError."""
    text = read_text(path, LARGEST_SCENE, SceneError)
    is_toml = path.suffix.lower() == ".toml"
    try:
        if is_toml and LONG_KEY.search(text):
            raise ValueError("a key has more than 64 parts")
        document = tomllib.loads(text) if is_toml else json.loads(text)
    except (ValueError, RecursionError) as error:  # Python refuses whole numbers of more than 4300 digits by a ValueError
        raise SceneError(f"{path}: is not {path.suffix[1:].upper()}: {error}") from None
    _refuse([(loc, message) for loc, message in checking.faults(document)], path)
    return document


def _refuse(faults: Sequence[tuple[tuple[str | int, ...], str]], path: Path) -> None:
    """Raises the faults of a document, given as pairs (key path, message), if there are any. Errors: SceneError."""
    if faults:
        lines = [f"{path}: {_key_path(loc)}{message}" for loc, message in faults[:MOST_FAULTS]]
        more = len(faults) - len(lines)
        raise SceneError([*lines, f"{path}: {more:,} more faults"] if more else lines)


def _key_path(loc: tuple[str | int, ...]) -> str:
    """Returns the start of a message, such as `objects[2].material.kd: `."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc)
    return text.lstrip(".") + ": " if text else ""
