"""Reads mesh files (OBJ with MTL, PLY, STL, OFF, glTF) and keeps what it read in the user's cache folder.

An entry of the cache holds the arrays, the materials and what they depend on. The readers, and trimesh with them, take
more than half a second to import; that happens only when a file is new.
"""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from glshade.errors import AssetError
from glshade.files import cache_folder
from glshade.mesh import formats
from glshade.mesh.formats.contents import EMBEDDED, Contents, Material
from glshade.mesh.mesh import Float64, Mesh

# Raise it when the same file would be read differently: entries of older loaders are then never looked at.
LOADER_VERSION = 3

SUFFIXES = frozenset(formats.READERS)


class AssetWarning(UserWarning):
    """Something a mesh file names is missing or not used; the mesh is drawn without it."""


@dataclass(frozen=True, eq=False)
class Part:
    """One mesh of a file, where the file puts it.

    transform: (4, 4) float64, object to file space, all nested transforms multiplied.
    material: in the scene file's form, or None where the file has none. Colours are linear Rec. 709 factors.
    """

    name: str
    mesh: Mesh
    transform: Float64
    material: Material | None


@dataclass(frozen=True, eq=False)
class Model:
    """All parts of a mesh file; parts that instance one mesh share the Mesh object."""

    parts: tuple[Part, ...]


def load(path: Path) -> Model:
    """The model in a mesh file, from memory or from the cache where the file and what it depends on are unchanged.

    Raises AssetError, one line starting with the path: missing, unreadable, broken, or nothing in it to draw.
    Warns with AssetWarning where a material file or a texture is missing.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise AssetError(f"{path}: unknown kind of mesh file; supported are {', '.join(sorted(SUFFIXES))}")
    full = Path(os.path.abspath(path))  # not resolved: a link's textures lie beside the link, as its writer saw them
    try:
        if path.is_dir():
            raise AssetError(f"{path}: is a folder, not a mesh file")
        stat = path.stat()
        remembered = _memory.get(full)
        if remembered and remembered[1] == _stamps(remembered[1]):
            return remembered[0]
        data = path.read_bytes()
    except FileNotFoundError:
        raise AssetError(f"{path}: no such file") from None
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror}") from None
    if not data.strip():
        raise AssetError(f"{path}: is empty")

    key = hashlib.sha256(f"{LOADER_VERSION}\0{full}\0".encode() + data).hexdigest()[:32]
    folder = cache_folder("meshes") / key
    contents = _recall(folder)
    if contents is None:
        contents = formats.read(path, full.parent, data)
        folder = _keep(contents, folder)
    for line in contents.warnings:
        warnings.warn(line, AssetWarning, stacklevel=2)
    model = _model(contents, folder)
    stamps = {full: (stat.st_mtime_ns, stat.st_size)} | _stamps(contents.dependencies)
    _memory[full] = model, stamps
    return model


Stamp: TypeAlias = tuple[int, int] | None

# What this process loaded, and the stamps of all files that it came from.
_memory: dict[Path, tuple[Model, dict[Path, Stamp]]] = {}


def _stamps(paths: Any) -> dict[Path, Stamp]:
    """Time and size of each file, None where there is none: equal stamps, equal contents, as far as one can see."""

    def stamp(path: Path) -> Stamp:
        try:
            stat = path.stat()
        except OSError:
            return None
        return stat.st_mtime_ns, stat.st_size

    return {Path(path): stamp(Path(path)) for path in paths}


# --- cache -----------------------------------------------------------------------------------------------------------


def _recall(folder: Path) -> Contents | None:
    """The cache's entry, or None where there is none, it is damaged, or what it depends on has changed."""
    try:
        stored = json.loads((folder / "entry.json").read_bytes())
        contents = Contents()
        contents.parts, contents.warnings = stored["parts"], stored["warnings"]
        contents.dependencies = stored["dependencies"]
        if any(_state(Path(file), state) != state for file, state in contents.dependencies.items()):
            return None
        for index, names in enumerate(stored["meshes"]):
            arrays = {name: np.load(folder / f"{index}.{name}.npy", allow_pickle=False) for name in names}
            contents.meshes.append(Mesh(**arrays))
        if not all((folder / name).is_file() for name in stored["images"]):
            return None
        _model(contents, folder)  # refuses indices and transforms that cannot be
    except Exception:  # whatever is wrong with an entry, the file itself is still there to read
        return None
    return contents


def _keep(contents: Contents, folder: Path) -> Path:
    """Write the entry and return where it lies; where the cache cannot be written, its images go to a folder that
    lasts as long as the process."""
    import atexit
    import shutil
    import tempfile

    partial: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=f"{folder.name}.", dir=folder.parent))
        names = []
        for index, mesh in enumerate(contents.meshes):
            arrays = {f.name: getattr(mesh, f.name) for f in fields(mesh) if getattr(mesh, f.name) is not None}
            for name, array in arrays.items():
                np.save(partial / f"{index}.{name}.npy", array)
            names.append(list(arrays))
        _write_images(contents, partial)
        entry = {
            "meshes": names,
            "parts": contents.parts,
            "images": list(contents.images),
            "dependencies": contents.dependencies,
            "warnings": contents.warnings,
        }
        (partial / "entry.json").write_text(json.dumps(entry))
        try:
            partial.rename(folder)
        except OSError:
            # There is an entry already: another process wrote it just now, from the same bytes, or it is outdated.
            if _recall(folder) is None:
                shutil.rmtree(folder, ignore_errors=True)
                partial.rename(folder)
            else:
                shutil.rmtree(partial, ignore_errors=True)
        return folder
    except OSError:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)
    if contents.images:
        folder = Path(tempfile.mkdtemp(prefix="glshade-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        _write_images(contents, folder)
    return folder


def _write_images(contents: Contents, folder: Path) -> None:
    for name, data in contents.images.items():
        (folder / name).write_bytes(data)


def _state(path: Path, like: str | None) -> str | None:
    """The dependency's state now, in the same terms as the state recorded."""
    if not path.is_file():
        return None
    return "present" if like == "present" else hashlib.sha256(path.read_bytes()).hexdigest()


def _model(contents: Contents, folder: Path) -> Model:
    def place(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: place(item) for key, item in value.items()}
        if isinstance(value, str) and value.startswith(EMBEDDED):
            return str(folder / value.removeprefix(EMBEDDED))
        return value

    parts = []
    for part in contents.parts:
        transform = np.array(part["transform"], dtype=np.float64).reshape(4, 4)
        transform.flags.writeable = False
        parts.append(Part(part["name"], contents.meshes[part["mesh"]], transform, place(part["material"])))
    return Model(tuple(parts))
