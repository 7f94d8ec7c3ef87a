"""Shaders: the GLSL files that programs are made from: their folders, contents and digest, and the include resolver.

The files under shaders/ are plain GLSL that any tool can read. A plan selects some of them; the remaining code (uniforms and
light loops) is generated into places that the files name in angle brackets, for example `#include <surface>`.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import TypeAlias

from glshade.document import nearest
from glshade.errors import ShaderError
from glshade.files import read_bytes
from glshade.glsl.source import Code, Declaration, Include, Stage, Storage
from glshade.limits import LARGEST_SHADER
from glshade.scene.models import model_folders, use_shader_models

_PACKAGE = Path(__file__).parent.parent
# A wheel holds the shaders inside the package; a checkout holds them beside it.
_INSTALLED = _PACKAGE / "_shaders"
SHIPPED = _INSTALLED if _INSTALLED.is_dir() else _PACKAGE.parent / "shaders"
# The folder of fast forms: fast/NAME replaces NAME in programs with fast arithmetic.
FAST = "fast"
# The folders to which a user's own model or light may add a file, NAME.glsl beside NAME.py.
OF_MODELS = ("brdf", "light")

_INCLUDE = re.compile(r'^\s*#include\s+(?:"([^"]+)"|<([^>]+)>)\s*(?://.*)?$')
# The declaration of a global variable in a shader file. clang-format leaves one declaration per line.
_VARIABLE = re.compile(
    r"^(?:layout\(.*?\) )?(?:invariant )?(?P<qualifier>flat |centroid |noperspective |smooth )?"
    r"(?P<storage>uniform|in|out) (?P<type>\w+) (?P<name>\w+)(?:\[(?P<count>\d+)\])?;"
)
_BLOCK = re.compile(r"^layout\(std140\) uniform (?P<name>\w+) \{")


# The modification time [ns] and the size [bytes] of a file.
Stamp: TypeAlias = tuple[int, int]


@dataclass(frozen=True)
class ShaderFile:
    """A shader file as it was read.

    path: its path.
    stamp: its modification time and size.
    lines: its text.
    """

    path: Path
    stamp: Stamp
    lines: tuple[str, ...]


class Shaders:
    """The files of shader folders, as they were when each was first read. Instances compare by identity.

    A file is looked up in the user's folders in their order, then among the user's models, then among the shipped files.
    If fast forms are asked for, the fast form of a file is preferred to the file itself and to files in later folders.

    own: the user's shader folders.
    models: the user's model folders.
    """

    def __init__(self, folders: Iterable[str | Path] = ()) -> None:
        """Reads the names in the folders; the files are read when they are first looked up.

        folders: the user's shader folders.
        Errors: ShaderError for a path that is not a folder, and for a fast form of a file that does not exist.
        """
        self.own = tuple(Path(os.path.abspath(folder)) for folder in folders)
        self.models = model_folders()
        for folder in self.own:
            if not folder.is_dir():
                raise ShaderError(f"{folder}: is no folder of shaders")
        # (name, whether the fast form is wanted) -> file; None where no folder has it.
        self._files: dict[tuple[str, bool], ShaderFile | None] = {}
        self._stamps: dict[str, Stamp | None] = {}
        self._folders = {path: _stamp(path) for folder in self.own for path in (folder, *_folders_below(folder))}
        for folder in (*self.own, SHIPPED):
            for name in _names(folder / FAST):
                if self.find(name) is None:
                    raise ShaderError(f"{folder / FAST / name}: is a fast form of {name}, which does not exist")

    def is_current(self, files: Iterable[str] | None = None) -> bool:
        """Returns whether no file and no folder has changed since it was read.

        files: optional; the paths of the files to check, as a stage's lines name them. Default: all that were read.
        """
        if self.models != model_folders() or any(_stamp(path) != stamp for path, stamp in self._folders.items()):
            return False
        return all(_stamp(path) == self._stamps[path] for path in (self._stamps if files is None else files))

    def find(self, name: str, fast: bool = False) -> ShaderFile | None:
        """Returns the file of a name below the folders, read now if it was not before; None where no folder has it.

        name: for example "math/unit.glsl".
        fast: whether to prefer the fast form.
        Errors: ShaderError for a file that cannot be read as text, and for a symbolic link that leads out of the user's folder.
        """
        if (name, fast) not in self._files:
            found = next(filter(None, map(_read, self._candidates(name, fast))), None)
            if found is not None:
                self._check_inside(found.path)
                self._stamps[str(found.path)] = found.stamp
            self._files[name, fast] = found
        return self._files[name, fast]

    def _check_inside(self, path: Path) -> None:
        """Checks that a file of a user's folder does not lie outside that folder. Errors: ShaderError."""
        folder = next((folder for folder in (*self.own, *self.models) if path.is_relative_to(folder)), None)
        if folder is not None and not path.resolve().is_relative_to(folder.resolve()):
            raise ShaderError(f"{path}: is a symbolic link that leads out of {folder}, so it is not read")

    def _candidates(self, name: str, fast: bool) -> Iterator[Path]:
        """Yields the paths where a file may lie, in the order of preference."""
        place = PurePosixPath(name)
        if place.is_absolute() or ".." in place.parts:
            return
        for folder in self.own:
            if fast:
                yield folder / FAST / name
            yield folder / name
        if len(place.parts) == 2 and place.parts[0] in OF_MODELS:
            yield from (folder / place.parts[1] for folder in self.models)
        if fast:
            yield SHIPPED / FAST / name
        yield SHIPPED / name

    def lines(self, path: str) -> tuple[str, ...]:
        """Returns the text of a file that was looked up before, line by line; nothing for another path."""
        return next((file.lines for file in self._files.values() if file is not None and str(file.path) == path), ())

    def read_own(self) -> None:
        """Reads all files of the user's folders, so that later changes of these files do not show. Errors: ShaderError."""
        names = {name for folder in self.own for name in _names(folder)}
        names |= {f"{part}/{path.name}" for folder in self.models for path in folder.glob("*.glsl") for part in OF_MODELS}
        for name in sorted(names):
            self.find(name)
            self.find(name, fast=True)

    @property
    def names(self) -> list[str]:
        """The names of all files below the folders, including fast forms."""
        own = {name for folder in (*self.own, SHIPPED) for name in _names(folder)}
        # Only the Python file beside it tells whether NAME.glsl is a model or a light, so it is listed as both.
        added = {f"{part}/{path.name}" for folder in self.models for path in folder.glob("*.glsl") for part in OF_MODELS}
        return sorted(own | {name for name in added if self.find(name) is not None})

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of all names and contents, in hexadecimal digits. It does not depend on the location of the folders."""
        h = hashlib.sha256()
        for name in self.names:
            file = self.find(name)
            if file is not None:
                h.update(f"\0{name}\0".encode() + "\n".join(file.lines).encode())
        return h.hexdigest()


_current: dict[tuple[Path, ...], Shaders] = {}


def current(folders: Iterable[str | Path] = ()) -> Shaders:
    """Returns the shader files of folders as they are now; the same object as in the last call if nothing has changed.

    Files brdf/NAME.glsl that replace no shipped file become reflectance models.
    folders: the user's shader folders, which come before the shipped one.
    Errors: ShaderError.
    """
    key = tuple(Path(os.path.abspath(folder)) for folder in folders)
    known = _current.get(key)
    if known is None or not known.is_current():
        use_shader_models(key)
        known = _current[key] = Shaders(key)
    return known


def expand(name: str, generated: Mapping[str, Code | str], shaders: Shaders | None = None, fast: bool = False) -> Stage:
    """Returns a stage: the file `name` with all its includes in place, each once.

    name: the name of the file below the shader folders.
    generated: place -> code for the includes in angle brackets.
    shaders: optional; the shader files. Default: those that ship with glshade.
    fast: whether fast forms replace the files that have one.
    Errors: ShaderError for a file that does not exist, or for a place without generated code.
    """
    return _Expansion(generated, shaders or current(), fast).stage(name)


class _Expansion:
    """The state of one expansion: the lines and declarations so far, and the includes that have been seen."""

    def __init__(self, generated: Mapping[str, Code | str], shaders: Shaders, fast: bool) -> None:
        self._generated, self._shaders, self._fast = generated, shaders, fast
        self._seen: set[str] = set()
        self._text: list[str] = []
        self._lines: list[tuple[str, int]] = []
        self._declared: list[tuple[int, Declaration]] = []
        self._faults: list[str] = []

    def stage(self, name: str) -> Stage:
        """Returns the stage whose text starts with the file `name`. Errors: ShaderError with every include that cannot be
        resolved.
        """
        self._include(name, name)
        if self._faults:
            raise ShaderError("\n".join(self._faults))
        return Stage("\n".join(self._text) + "\n", tuple(self._lines), tuple(self._declared))

    def _include(self, name: str, asked_from: str) -> None:
        if name in self._seen:
            return
        self._seen.add(name)
        file = self._shaders.find(name, self._fast)
        if file is None:
            self._faults.append(f'{asked_from}: no shader file "{name}"{nearest(name, self._shaders.names)}')
            return
        self._written(str(file.path), file.lines)

    def _fill(self, place: str, asked_from: str) -> None:
        """Adds the generated code of a place."""
        name = f"<{place}>"
        if name in self._seen:
            return
        self._seen.add(name)
        if place not in self._generated:
            self._faults.append(f"{asked_from}: nothing is generated for {name}{nearest(place, self._generated)}")
            return
        code = self._generated[place]
        if isinstance(code, str):
            self._written(name, code.splitlines())
            return
        for number, entry in enumerate(code.entries, 1):
            if isinstance(entry, Include):
                self._include(entry.name, f"{name}:{number}")
            else:
                self._add(str(entry), name, number, entry if isinstance(entry, Declaration) else None)

    def _written(self, file: str, lines: Iterable[str]) -> None:
        """Adds the text of a file: its includes are resolved, and its declarations are recognised."""
        for number, line in enumerate(lines, 1):
            include = _INCLUDE.match(line)
            if include is None and "#include" in line:
                self._no_include(line, file, number)
            elif include is None:
                self._add(line, file, number, _declaration(line))
            elif include[1] is not None:
                self._include(include[1], f"{file}:{number}")
            else:
                self._fill(include[2], f"{file}:{number}")

    def _no_include(self, line: str, file: str, number: int) -> None:
        """Adds a line in which #include stands in a comment; any other line is a fault.

        moderngl looks for #include anywhere in a text, so the comment is added without its sign.
        """
        code, slashes, comment = line.partition("//")
        if "#include" in code:
            self._faults.append(f'{file}:{number}: is no valid include; an include is #include "FILE" or #include <PLACE>')
        self._add(f"{code}{slashes}{comment.replace('#include', 'include')}", file, number, None)

    def _add(self, line: str, file: str, number: int, declaration: Declaration | None) -> None:
        if declaration is not None:
            self._declared.append((len(self._text), declaration))
        self._text.append(line)
        self._lines.append((file, number))


def _declaration(line: str) -> Declaration | None:
    """Returns the global variable or uniform block that a line of a file declares; None for any other line."""
    variable = _VARIABLE.match(line)
    if variable is not None:
        storage: Storage = variable["storage"]  # type: ignore[assignment]
        qualifier = (variable["qualifier"] or "").strip()
        return Declaration(storage, variable["type"], variable["name"], int(variable["count"] or 0), qualifier)
    block = _BLOCK.match(line)
    return Declaration("block", "", block["name"]) if block else None


def _names(folder: Path) -> list[str]:
    """Returns the paths of the files below a folder, relative to it, in alphabetical order."""
    return [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*")) if path.is_file()]


def _folders_below(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.is_dir())


def _read(path: Path) -> ShaderFile | None:
    """Returns the file at a path; None if there is none. Errors: ShaderError for a file that cannot be read as text."""
    stamp = _stamp(path)
    if stamp is None or not path.is_file():
        return None
    try:
        return ShaderFile(path, stamp, tuple(read_bytes(path, LARGEST_SHADER).decode("utf-8").splitlines()))
    except UnicodeDecodeError as error:
        raise ShaderError(f"{path}: is not UTF-8 text (byte {error.start})") from None
    except OSError as error:
        raise ShaderError(f"{path}: cannot be read: {error.strerror}") from None


def _stamp(path: str | Path) -> Stamp | None:
    """Returns the stamp of a file or folder; None if the path does not exist."""
    try:
        stat = os.stat(path)
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size
