"""Dependencies: the files and folders that a picture depends on, also where the scene is broken or a file is missing."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from glshade.files import read_bytes
from glshade.glsl.shaders import SHIPPED
from glshade.limits import LARGEST_SCENE

# The keys of a scene file whose values are paths of files. Some of them may hold another name, which then names no file.
PATHS = frozenset({"mesh", "texture", "ocio", "file", "spectrum", "reradiation", "white"})


def folders_of(*roots: str | Path) -> set[Path]:
    """Returns the folders of shaders and models whose files count: these, the shipped one, and all folders below them."""
    return {folder for root in map(Path, (*roots, SHIPPED)) for folder in (root, *_below(root))}


def leniently_named(path: Path) -> set[Path]:
    """Returns the files that a scene file names, as absolute paths, even if they are missing.

    A scene file that cannot be read names none, and a mesh file neither: its materials and textures are known once it is read.
    """
    try:
        text = read_bytes(path, LARGEST_SCENE).decode("utf-8-sig")
        document = tomllib.loads(text) if path.suffix.lower() == ".toml" else json.loads(text)
    except (OSError, ValueError, RecursionError):
        return set()
    folder = path.parent.resolve()
    return {folder / name for name in _names(document)}


def _names(value: Any, key: str = "") -> Iterator[str]:
    """Yields the texts in a document that are paths of files. key: the key of the value."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _names(item, name)
    elif isinstance(value, list):
        for item in value:
            yield from _names(item, key)
    elif isinstance(value, str) and key in PATHS and "\0" not in value:
        yield value


def _below(root: Path) -> Iterable[Path]:
    """Returns the folders below a folder."""
    return (path for path in root.rglob("*") if path.is_dir() and path.name != "__pycache__")
