"""Snapshot: a folder with the last good revision, from which another process can draw it.

The revision is pickled. The contents of a mesh file are pickled to a file of their own, which is written only once, because
most edits do not change them.
"""

from __future__ import annotations

import io
import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import uuid4
from weakref import WeakKeyDictionary

from glshade.errors import SceneError
from glshade.live.revision import Revision
from glshade.mesh.model import Model
from glshade.scene.models import files_digest, use_glsl_models, use_models

# The files of a snapshot: the revision, and the models that have to be known before it can be read.
REVISION, FOLDERS = "revision.pickle", "models.pickle"


class Snapshot:
    """A folder that holds one revision.

    folder: the folder.
    """

    def __init__(self, folder: Path) -> None:
        """folder: the folder, which is made if need be."""
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        # The names of the files that hold the contents of mesh files.
        self._names: WeakKeyDictionary[Model, str] = WeakKeyDictionary()

    @property
    def exists(self) -> bool:
        """Whether the folder holds a revision."""
        return (self.folder / REVISION).exists()

    def write(self, revision: Revision) -> None:
        """Writes a revision in place of the one that the folder holds. Errors: OSError."""
        names: set[str] = set()

        def name_of(model: Model) -> str:
            names.add(self._stored(model))
            return self._names[model]

        memory = io.BytesIO()
        _Pickler(memory, name_of).dump(revision)
        self._replace(FOLDERS, pickle.dumps((self._folders(revision), revision.glsl_models)))
        self._replace(REVISION, memory.getvalue())
        for path in self.folder.glob("model-*.pickle"):
            if path.name not in names:
                path.unlink(missing_ok=True)

    def _replace(self, name: str, data: bytes) -> None:
        """Writes a file of the folder, whole or not at all. It need not survive a power failure, which takes the server too."""
        new = self.folder / f"{name}.new"
        new.write_bytes(data)
        os.replace(new, self.folder / name)

    def _stored(self, model: Model) -> str:
        """Returns the name of the file that holds the contents of a mesh file, which is written now if it was not before."""
        if model not in self._names:
            # The name is new, because the folder may hold files of a process that has ended.
            name = f"model-{uuid4().hex}.pickle"
            (self.folder / name).write_bytes(pickle.dumps(model))
            self._names[model] = name
        return self._names[model]

    def _folders(self, revision: Revision) -> list[tuple[Path, str, Path]]:
        """Returns (model folder, digest of its Python files, a copy of the folder) of each model folder."""
        listed = []
        for folder in revision.models:
            digest = files_digest(folder)
            copy = self.folder / f"models-{digest[:16]}"
            if not copy.is_dir():
                shutil.copytree(folder, copy, ignore=lambda _, names: [x for x in names if not x.endswith((".py", ".glsl"))])
            listed.append((folder, digest, copy))
        return listed


def restored(folder: Path) -> Revision:
    """Returns the revision in the folder of a snapshot.

    Errors: SceneError where there is none. A model folder whose Python files have changed is replaced by its copy.
    """
    try:
        folders, glsl_models = pickle.loads((folder / FOLDERS).read_bytes())
        for original, digest, copy in folders:
            unchanged = original.is_dir() and files_digest(original) == digest
            use_models(original if unchanged else copy)
        use_glsl_models(glsl_models)
        with (folder / REVISION).open("rb") as file:
            revision: Revision = _Unpickler(file, folder).load()
    except (OSError, EOFError, pickle.UnpicklingError) as error:
        raise SceneError(f"{folder}: holds no revision to restore: {error}") from None
    return revision


class _Pickler(pickle.Pickler):
    """Writes the name of a file in place of the contents of a mesh file. name_of: returns that name."""

    def __init__(self, file: io.BytesIO, name_of: Callable[[Model], str]) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self._name_of = name_of

    def persistent_id(self, value: Any) -> str | None:
        return self._name_of(value) if isinstance(value, Model) else None


class _Unpickler(pickle.Unpickler):
    """Reads the contents of mesh files from files of their own, in a folder."""

    def __init__(self, file: Any, folder: Path) -> None:
        super().__init__(file)
        self._folder = folder

    def persistent_load(self, name: str) -> Any:
        return pickle.loads((self._folder / name).read_bytes())
