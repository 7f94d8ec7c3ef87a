"""File: the mesh file being read, what it needs on the way, and what comes of it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from glshade.errors import AssetError
from glshade.mesh.formats.contents import Contents
from glshade.mesh.mesh import Mesh


@dataclass
class File:
    """The bytes of a mesh file and the folder in which it finds others."""

    path: Path  # as the user wrote it, for messages
    folder: Path
    data: bytes
    contents: Contents = field(default_factory=Contents)

    def fail(self, message: str) -> AssetError:
        return AssetError(f"{self.path}: {' '.join(message.split())}")

    def warn(self, message: str) -> None:
        line = f"{self.path}: {' '.join(message.split())}"
        if line not in self.contents.warnings:
            self.contents.warnings.append(line)

    def beside(self, name: str) -> Path:
        """The file of that name, which another system may have written: with backslashes, a folder that is not
        here, or letters of the other case."""
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
        """The bytes of a file this one depends on, None where it is missing."""
        try:
            data = path.read_bytes()
        except OSError:
            self.contents.dependencies[str(path)] = None
            return None
        self.contents.dependencies[str(path)] = hashlib.sha256(data).hexdigest()
        return data

    def texture(self, name: str) -> str | None:
        """The absolute path of a texture, None (with a warning) where it is missing."""
        path = self.beside(name)
        found = path.is_file()
        self.contents.dependencies[str(path)] = "present" if found else None
        if not found:
            self.warn(f"texture '{name}' not found; drawn without it")
        return str(path) if found else None

    def build(self, where: str, *arrays: Any, **named: Any) -> Mesh:
        try:
            return Mesh.build(*arrays, **named)
        except AssetError as error:
            raise self.fail(f"{where}{error}") from None


def text_of(data: bytes) -> str:
    """The text in whatever encoding, its lines ended by \\n."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")
