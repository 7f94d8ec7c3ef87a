"""Textures: makes the materials of a mesh file plain where their textures cannot be drawn, the same for every format."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from glshade.errors import AssetError
from glshade.limits import TEXELS_PER_BYTE
from glshade.mesh.reading.contents import EMBEDDED, Material
from glshade.mesh.reading.file import MeshFile

# The keys of a material whose textures have no plain value in their place.
_MAPS = frozenset({"normal_map", "bump_map", "emission", "occlusion"})


def settle(file: MeshFile) -> None:
    """Leaves out the pictures that cannot be decoded, with a warning each."""
    contents = file.contents
    broken: dict[str, str | None] = {}
    for part in contents.parts:
        material = part["material"]
        paths = _paths(material)
        for path in paths:
            if path not in broken:
                broken[path] = _fault(file, path)
        if any(broken[path] for path in paths):
            part["material"] = plain(material, {path for path in paths if broken[path]})
    for path, reason in broken.items():
        if reason:
            name = "an embedded picture" if path.startswith(EMBEDDED) else f"texture '{Path(path).name}'"
            file.warn(f"{name} {reason}; drawn without it")
    for path in [path for path, reason in broken.items() if reason and path.startswith(EMBEDDED)]:
        del contents.images[path.removeprefix(EMBEDDED)]


def _paths(material: Material | None) -> set[str]:
    """Returns the paths of a material's textures."""
    return {value["texture"] for value in (material or {}).values() if _is_texture(value)}


def _is_texture(value: Any) -> bool:
    """Returns whether the value of a material's key is the table of a texture."""
    return isinstance(value, dict) and "texture" in value


def plain(material: Material, paths: set[str] | None = None) -> Material:
    """Returns a material without its textures. The same object is returned where it has none.

    A texture's factor takes the place of a colour or of a number. Maps of normals, heights, emission and occlusion are dropped.
    paths: optional; the paths of the textures to drop. Default: all.
    """
    if not any(map(_is_texture, material.values())):
        return material
    result: Material = {}
    for key, value in material.items():
        if not _is_texture(value) or (paths is not None and value["texture"] not in paths):
            result[key] = value
        elif key == "tangent_direction":
            result[key] = value.get("rotate", 0.0)
        elif key not in _MAPS:
            result[key] = _white(value)
    return result


def unplaced(name: str) -> str:
    """Returns the warning about a part without texture coordinates whose material has textures."""
    return f"{name} has no texture coordinates; drawn without the textures of its material"


def _white(texture: dict[str, Any]) -> Any:
    """Returns the value of a texture's parameter where the picture is white."""
    factor, added = texture.get("factor", 1.0), texture.get("add", 0.0)
    if not isinstance(factor, list):
        return factor + added
    more = added if isinstance(added, list) else [added] * len(factor)
    return [x + y for x, y in zip(factor, more, strict=True)]


def _fault(file: MeshFile, path: str) -> str | None:
    """Returns the reason why a picture cannot be drawn; None for one that can."""
    if not path.startswith(EMBEDDED):
        reason = _undecodable(file, Path(path))
        if reason:
            # The material depends on the content of the picture, so that it is read again after a repair.
            file.read(Path(path))
        return reason
    name = path.removeprefix(EMBEDDED)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / name
        copy.write_bytes(file.contents.images[name])
        return _undecodable(file, copy)


def _undecodable(file: MeshFile, path: Path) -> str | None:
    """Returns the reason why a picture cannot be decoded; None for one that can, or that is too large."""
    from glshade.image import file as picture_file

    try:
        picture_file.check_stored(path)
        # The renderer refuses pictures with too many pixels, and names the option that allows them.
        if picture_file.pixel_count(path) <= max(file.limits.max_texels, TEXELS_PER_BYTE * path.stat().st_size):
            picture_file.check(path)
    except AssetError as error:
        return str(error).removeprefix(f"{path}: ")
    return None
