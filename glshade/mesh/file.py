"""Mesh files: loads OBJ with MTL, PLY, STL, OFF, glTF and every other format that has a reader in glshade/mesh/formats.

A file is looked up in memory first and then in the user's cache folder. The readers are imported only when a file is in
neither.
"""

from __future__ import annotations

import hashlib
import os
import warnings
from dataclasses import replace
from pathlib import Path

from glshade.errors import AssetError
from glshade.errors import AssetWarning as AssetWarning
from glshade.files import read_bytes, user_cache
from glshade.limits import DEFAULT, LARGEST_MESH, Limits
from glshade.lru import WeakLru
from glshade.mesh import formats
from glshade.mesh.entries import entry_of, keep, recall
from glshade.mesh.formats import SUFFIXES as SUFFIXES
from glshade.mesh.model import Model, model_of, stamps
from glshade.mesh.reading.file import MeshFile

# Raise this number when a reader changes so that the same file gives another model: older cache entries are then ignored.
LOADER_VERSION = 5
# Git LFS checks out a text that begins like this in place of a file that it has not fetched (git-lfs, docs/spec.md).
LFS_POINTER = b"version https://git-lfs.github.com/spec/"
# Models that nobody refers to stay in memory up to this total size [bytes]. The newest model stays in any case.
REMEMBERED = 32 << 20
# A model keeps alive about this many times the bytes of its arrays: the meshes that are made from it for drawing, and their
# buffers on the GPU.
DRAWN = 5

# The models that this process loaded. The key holds the absolute path of the file and everything else that decides which
# other files it may name.
_memory: WeakLru[tuple[Path, bool, frozenset[Path]], Model] = WeakLru(REMEMBERED)


def load(path: Path, limits: Limits = DEFAULT, folders: frozenset[Path] = frozenset()) -> Model:
    """Returns the model in a mesh file.

    A second call returns the same object, unless the file or a file that it depends on has changed. A model that nobody refers
    to is kept only while it is among the most recently used ones.

    path: the mesh file.
    limits: the limits of the scene that names the file.
    folders: folders, without symbolic links, in which the file may name other files, in addition to its own folder.

    Errors: AssetError, one line that starts with the path, if the file is missing, unreadable or broken, holds nothing to draw
    or more triangles than the limits allow, or names a buffer outside the folders. Warns with AssetWarning if a material file
    or a texture is missing or lies outside the folders.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise AssetError(f"{path}: unknown kind of mesh file; supported are {', '.join(SUFFIXES)}")
    # Symbolic links are not resolved: the textures of a linked file lie beside the link, where its writer saw them.
    full = Path(os.path.abspath(path))
    try:
        if path.is_dir():
            raise AssetError(f"{path}: is a folder, not a mesh file")
        home = full.parent.resolve()
        # Folders below the file's own folder change nothing, so they do not divide the cache.
        folders = frozenset(folder for folder in folders if not folder.is_relative_to(home))
        key = full, limits.allow_outside, folders
        model = _memory.get(key)
        if model is not None and model.unchanged:
            if model.entry is not None:
                user_cache().used(model.entry)
            return model
        # The stamp (modification time and size) is taken before the bytes are read, so that the next call notices a file that
        # changes in between.
        before = stamps([full])
        data = read_bytes(path, LARGEST_MESH)
    except FileNotFoundError:
        raise AssetError(f"{path}: no such file") from None
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror}") from None
    if not data.strip():
        raise AssetError(f"{path}: is empty")
    if data.startswith(LFS_POINTER):
        raise AssetError(f"{path}: is a pointer of Git LFS and not the file itself; `git lfs pull` fetches the file")

    named = "\0".join(map(str, [LOADER_VERSION, full, limits.allow_outside, *sorted(folders)]))
    entry = entry_of(hashlib.sha256(os.fsencode(f"{named}\0") + data).hexdigest()[:32])
    file = MeshFile(path, full.parent, data, limits=limits, folders=folders | {home})
    contents = recall(entry)
    # A file that was inside when the entry was written may be a symbolic link to the outside now.
    if contents is None or any(state and file.is_outside(Path(name)) for name, state in contents.dependencies.items()):
        contents = formats.read(file)
        entry = keep(contents, entry)
    for line in contents.warnings:
        warnings.warn(line, AssetWarning, stacklevel=2)
    model = model_of(contents, entry)
    model = replace(model, stamps=before | model.stamps)
    return _memory.put(key, model, DRAWN * model.nbytes)
