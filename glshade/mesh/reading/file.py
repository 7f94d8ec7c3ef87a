"""File: the mesh file that a reader reads, its access to other files, and the contents that it collects."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from glshade.errors import AssetError
from glshade.files import read_bytes
from glshade.limits import DEFAULT, LARGEST_MESH, Limits
from glshade.mesh.checking import Faults
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading.contents import Contents
from glshade.mesh.strokes import build_strokes
from glshade.mesh.surface import build_surface

# The end of a message about a file that must not be named.
OUTSIDE = "lies outside the folders of the mesh and the scene's files (--allow-outside reads it)"


@dataclass
class MeshFile:
    """A mesh file while it is read.

    path: the path as the user wrote it, for messages.
    folder: the absolute path of the folder in which the file lies.
    data: the bytes of the file.
    contents: everything that the reader has found so far.
    limits: the limits of the scene that names the file.
    folders: the folders, without symbolic links, in which the file may name other files.
    normal_maps: picture file -> whether it holds normals, for the pictures that the reader has looked at.
    faults: counts what was left out of the meshes of the file. The file gets one warning for each kind.
    """

    path: Path
    folder: Path
    data: bytes
    contents: Contents = field(default_factory=Contents)
    limits: Limits = DEFAULT
    folders: frozenset[Path] = frozenset()
    normal_maps: dict[Path, bool] = field(default_factory=dict)
    faults: Faults = field(default_factory=Faults)
    # Folder -> the files in it, by their names in lower case.
    _listed: dict[Path, dict[str, Path]] = field(default_factory=dict)
    # Path -> the bytes that were read, because a file may name another one many times.
    _read: dict[Path, bytes | None] = field(default_factory=dict)

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
        if is_file(exact):
            return exact
        for folder in (self.folder,) if self.is_outside(exact.parent) else (exact.parent, self.folder):
            found = self._files(folder).get(exact.name.lower())
            if found is not None:
                return found
        return exact

    def _files(self, folder: Path) -> dict[str, Path]:
        """Returns the files in a folder, by their names in lower case; none where the folder cannot be read."""
        if folder not in self._listed:
            try:
                paths = sorted(folder.iterdir(), reverse=True)
            except (OSError, ValueError):
                paths = []
            self._listed[folder] = {path.name.lower(): path for path in paths if is_file(path)}
        return self._listed[folder]

    def is_outside(self, path: Path) -> bool:
        """Returns whether this file must not name a path, because it leads out of the folders once its symbolic links are
        resolved.
        """
        if self.limits.allow_outside:
            return False
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):  # a loop of links, or a name that no file can have
            return True
        return not any(real.is_relative_to(folder) for folder in self.folders)

    def read(self, path: Path) -> bytes | None:
        """Returns the bytes of a file on which this one depends; None where it cannot be read.

        The caller must have made sure that the file is not outside.
        """
        if path not in self._read:
            try:
                data = self._read[path] = read_bytes(path, LARGEST_MESH)
                self.contents.dependencies[str(path)] = hashlib.sha256(data).hexdigest()
            except (OSError, ValueError):
                self._read[path] = self.contents.dependencies[str(path)] = None
        return self._read[path]

    def texture(self, name: str) -> str | None:
        """Returns the absolute path of a texture; None, with a warning, where it is missing or outside."""
        path = self.beside(name)
        outside = self.is_outside(path)
        found = not outside and is_file(path)
        self.contents.dependencies[str(path)] = "present" if found else None
        if not found:
            self.warn(f"texture '{short(name)}' {OUTSIDE if outside else 'not found'}; drawn without it")
        return str(path) if found else None

    def build(self, where: str, positions: Any, triangles: Any, *arrays: Any, **named: Any) -> Mesh:
        """Returns the mesh that `Mesh.build` makes from these arrays. Errors: AssetError, with path and `where` in front."""
        given = dict(zip(("normals", "uvs", "colours"), arrays, strict=False))
        mesh = self.build_surface(where, [{"positions": positions, "triangles": triangles, **given, **named}])[0]
        assert mesh is not None  # where no triangle is left, there was an error
        return mesh

    def build_surface(self, where: str, parts: Sequence[Mapping[str, Any]]) -> list[Mesh | None]:
        """Returns the meshes of the parts of one surface, as in glshade.mesh.surface; None for a part without triangles.

        What is left out or replaced is counted in `faults`.
        Errors: AssetError, with path and `where` in front.
        """
        try:
            return build_surface(parts, self.faults)
        except AssetError as error:
            raise self.fail(f"{where}{error}") from None

    def build_points(self, where: str, positions: Any, indices: Any = None, **named: Any) -> Mesh:
        """Returns the mesh of the points with these indices (N,), by default of all vertices; else as `build_lines` does."""
        points = np.arange(len(positions)) if indices is None else np.asarray(indices).reshape(-1)
        return self.build_lines(where, positions, np.stack([points, points], axis=1), **named)

    def build_lines(self, where: str, positions: Any, lines: Any, **named: Any) -> Mesh:
        """Returns the mesh that `build_strokes` makes of lines (S, 2) between vertices.

        where: the place in the file, which precedes a message.
        named: the optional arrays `normals`, `uvs` and `colours`.
        Errors: AssetError. Warns where lines have positions that are not finite.
        """
        try:
            mesh, lost = build_strokes(positions, lines, **named)
        except AssetError as error:
            raise self.fail(f"{where}{error}") from None
        if lost:
            self.warn(f"{where}{lost:,} points or lines have positions that are not finite numbers; drawn without them")
        return mesh


def short(name: str) -> str:
    """Returns a name for a message, without its middle where it is very long."""
    return name if len(name) <= 200 else f"{name[:100]} ... {name[-90:]}"


def is_file(path: Path) -> bool:
    """Returns whether a path leads to a regular file. A name that no file can have leads to none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def text_of(data: bytes) -> str:
    """Returns the text of a file in UTF-8, or else in Latin-1, with \\n as every line ending."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")
