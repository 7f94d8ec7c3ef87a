"""Scene files: TOML, JSON of the same shape, or a bare mesh, which is a scene too."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from glshade import mesh_file
from glshade.document import Document
from glshade.errors import AssetError, SceneError
from glshade.image import probe
from glshade.scene import Film, Object, Scene
from glshade.texture import Picture

TEXT_SUFFIXES = (".toml", ".json")


def load(path: str | Path) -> Scene:
    """The scene in a file, with its meshes read.

    A mesh file is framed by a camera, lit by the default rig and drawn in its own material. Errors: SceneError with every
    fault: file, key path, what is allowed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix in mesh_file.SUFFIXES:
        mesh_file.load(path)
        return Scene(
            description=path.name,
            objects=(Object(name=path.stem, mesh=path),),
            film=Film(samples=4, background=BACKDROP),
        )
    if suffix not in TEXT_SUFFIXES:
        known = ", ".join([*TEXT_SUFFIXES, *sorted(mesh_file.SUFFIXES)])
        raise SceneError(f"{path}: {suffix or 'no extension'} is neither a scene nor a mesh; known: {known}")
    scene = parse(_read(path), path)
    problems: list[str] = []
    for index, item in enumerate(scene.objects):
        if isinstance(item.mesh, Path):
            try:
                mesh_file.load(item.mesh)
            except SceneError as error:
                problems.extend(f"{path}: objects[{index}].mesh: {problem}" for problem in error.problems)
    for place, picture in _pictures(scene):
        try:
            probe(picture)
        except AssetError as error:
            problems.append(f"{path}: {place}: {error}")
    if problems:
        raise SceneError(problems)
    return scene


def _pictures(scene: Scene) -> Iterator[tuple[str, Path]]:
    """(key path, file) of every texture."""
    materials: dict[str, Any] = {f"materials.{name}": material for name, material in scene.materials.items()}
    materials |= {f"objects[{index}].material": item.material for index, item in enumerate(scene.objects)}
    for place, material in materials.items():
        if isinstance(material, Document):
            for name in type(material).model_fields:
                value = getattr(material, name)
                if isinstance(value, Picture):
                    yield f"{place}.{name}.texture", value.texture


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
