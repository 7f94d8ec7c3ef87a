"""Entries: mesh files in the user's cache folder, in a form that needs no parser.

An entry is a folder with the arrays of the meshes, the pictures that the file embeds, and `entry.json` with the parts and the
state of every other file that was looked at. `entry.json` also has checksums of the meshes and the pictures, and begins with a
line that holds the checksum of the rest. An entry with a wrong checksum counts as missing.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields
from pathlib import Path

import numpy as np

from glshade.files import user_cache
from glshade.mesh.mesh import Mesh
from glshade.mesh.model import model_of
from glshade.mesh.reading.contents import Contents


def entry_of(key: str) -> Path:
    """Returns the folder of the entry with this key. It need not exist yet."""
    return user_cache().part("meshes") / key


def recall(folder: Path) -> Contents | None:
    """Returns the contents of an entry; None if it does not exist, is damaged, or depends on a file that has changed."""
    try:
        checksum, data = (folder / "entry.json").read_bytes().split(b"\n", 1)
        if checksum.decode() != _checksum(data):
            return None
        stored = json.loads(data)
        contents = Contents()
        contents.parts, contents.warnings = stored["parts"], stored["warnings"]
        contents.cameras, contents.lights = stored["cameras"], stored["lights"]
        contents.dependencies = stored["dependencies"]
        if any(_state(Path(file), state) != state for file, state in contents.dependencies.items()):
            return None
        for index, (names, digest) in enumerate(stored["meshes"]):
            mesh = Mesh(**{name: np.load(folder / f"{index}.{name}.npy", allow_pickle=False) for name in names})
            if mesh.digest != digest:
                return None
            contents.meshes.append(mesh)
        if any(_checksum((folder / name).read_bytes()) != checksum for name, checksum in stored["images"].items()):
            return None
        model_of(contents, folder)  # raises if an index or a transform is wrong
    except Exception:  # a damaged entry may raise anything, and the mesh file itself can be read instead
        return None
    user_cache().used(folder)
    return contents


def keep(contents: Contents, folder: Path) -> Path:
    """Writes an entry and returns its folder.

    Where the cache folder cannot be written, the embedded pictures are written to a temporary folder, which is returned and
    which is deleted when the process ends.
    """
    import atexit
    import shutil
    import tempfile

    partial: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=f"{folder.name}.", dir=folder.parent))
        _write(contents, partial)
        try:
            partial.rename(folder)
        except OSError:
            # There is an entry already. Either another process has just written it from the same bytes, or it is outdated.
            if recall(folder) is None:
                shutil.rmtree(folder, ignore_errors=True)
                partial.rename(folder)
            else:
                shutil.rmtree(partial, ignore_errors=True)
        user_cache().added(folder)
        return folder
    except OSError:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)
    if contents.images:
        folder = Path(tempfile.mkdtemp(prefix="glshade-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        _write_images(contents, folder)
    return folder


def _write(contents: Contents, folder: Path) -> None:
    """Writes the files of an entry into a folder. Errors: OSError."""
    meshes = []
    for index, mesh in enumerate(contents.meshes):
        arrays = {f.name: getattr(mesh, f.name) for f in fields(mesh) if getattr(mesh, f.name) is not None}
        for name, array in arrays.items():
            np.save(folder / f"{index}.{name}.npy", array)
        meshes.append((list(arrays), mesh.digest))
    _write_images(contents, folder)
    entry = {
        "meshes": meshes,
        "parts": contents.parts,
        "cameras": contents.cameras,
        "lights": contents.lights,
        "images": {name: _checksum(data) for name, data in contents.images.items()},
        "dependencies": contents.dependencies,
        "warnings": contents.warnings,
    }
    data = json.dumps(entry).encode()
    (folder / "entry.json").write_bytes(f"{_checksum(data)}\n".encode() + data)


def _write_images(contents: Contents, folder: Path) -> None:
    for name, data in contents.images.items():
        (folder / name).write_bytes(data)


def _checksum(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _state(path: Path, recorded: str | None) -> str | None:
    """Returns the state of a dependency now, in the form of the recorded state (see Contents.dependencies)."""
    if not path.is_file():
        return None
    return "present" if recorded == "present" else hashlib.sha256(path.read_bytes()).hexdigest()
