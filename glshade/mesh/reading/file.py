"""File: the mesh file that a reader reads, its access to other files, and the contents that it collects."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from glshade.errors import AssetError
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading.contents import Contents


@dataclass
class MeshFile:
    """A mesh file while it is read.

    path: the path as the user wrote it, for messages.
    folder: the absolute path of the folder in which the file lies.
    data: the bytes of the file.
    contents: everything that the reader has found so far.
    """

    path: Path
    folder: Path
    data: bytes
    contents: Contents = field(default_factory=Contents)

    def fail(self, message: str) -> AssetError:
        """Returns an error to raise: one line that starts with the path."""
        return AssetError(f"{self.path}: {' '.join(message.split())}")

    def warn(self, message: str) -> None:
        """Adds a warning, one line that starts with the path, unless it was added already."""
        line = f"{self.path}: {' '.join(message.split())}"
        if line not in self.contents.warnings:
            self.contents.warnings.append(line)

    def beside(self, name: str) -> Path:
        """Returns the path of another file that this one names.

        The name may come from another system: it may have backslashes, a folder that does not exist here, or letters of the
        other case. If no file fits, the result is the path that the name spells.
        """
        name = name.replace("\\", "/")
        exact = self.folder / name
        if exact.is_file():
            return exact
        for folder in (exact.parent, self.folder):
            if folder.is_dir():
                for found in sorted(folder.iterdir()):
                    if found.name.lower() == exact.name.lower() and found.is_file():
                        return found
        return exact

    def read(self, path: Path) -> bytes | None:
        """Returns the bytes of a file on which this one depends; None where it cannot be read."""
        try:
            data = path.read_bytes()
        except OSError:
            self.contents.dependencies[str(path)] = None
            return None
        self.contents.dependencies[str(path)] = hashlib.sha256(data).hexdigest()
        return data

    def texture(self, name: str) -> str | None:
        """Returns the absolute path of a texture; None, with a warning, where it is missing."""
        path = self.beside(name)
        found = path.is_file()
        self.contents.dependencies[str(path)] = "present" if found else None
        if not found:
            self.warn(f"texture '{name}' not found; drawn without it")
        return str(path) if found else None

    def build(self, where: str, *arrays: Any, **named: Any) -> Mesh:
        """Returns the mesh that `Mesh.build` makes from these arrays. Errors: AssetError, with path and `where` in front."""
        try:
            return Mesh.build(*arrays, **named)
        except AssetError as error:
            raise self.fail(f"{where}{error}") from None


def text_of(data: bytes) -> str:
    """Returns the text of a file in UTF-8, or else in Latin-1, with \\n as every line ending."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")
