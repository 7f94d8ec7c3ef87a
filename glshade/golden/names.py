"""Names: the names of the files in a folder of baselines, and which of them belong together."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

from glshade.errors import GlshadeError, is_printable

# The formats of baselines. They lose nothing, and hold either 8-bit codes or floats.
SUFFIXES = (".png", ".exr")
# Separates a baseline's name from the key of a variant.
MARK = "@"
KEY = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*")
# The end of a sidecar's name: the sidecar of ball.png is ball.png.glshade.json.
SIDECAR_SUFFIX = ".glshade.json"


def check_name(name: str) -> None:
    """Checks the name of a baseline: a relative path with slashes and a suffix of SUFFIXES, such as `cars/red.png`.

    Errors: GlshadeError for an absolute path, "..", a hidden file or folder, "@" (which marks variants), control characters.
    """
    parts = name.split("/")
    if name.startswith("/") or "\\" in name or ".." in parts:
        raise GlshadeError(f'{name}: a baseline is named by a path in its folder, without ".." and backslashes')
    if any(not part or part.startswith(".") for part in parts):
        raise GlshadeError(f'{name}: no part of a baseline\'s name is empty or starts with "."')
    if not is_printable(name):
        raise GlshadeError(f"{name}: has control characters in its name; rename it")
    if not name.lower().endswith(SUFFIXES):
        raise GlshadeError(f"{name}: a baseline is a PNG or an OpenEXR file, which lose nothing: {' or '.join(SUFFIXES)}")
    if MARK in parts[-1]:
        raise GlshadeError(f'{name}: "{MARK}" in a name marks the variants of a baseline; rename the picture')


def check_key(key: str) -> None:
    """Checks the key of a variant: ASCII letters, digits, "." (not first), "-" and "_". Errors: GlshadeError."""
    if not KEY.fullmatch(key):
        raise GlshadeError(f'{key!r} is no key of a variant: use letters, digits, "-", "_" and ".", which is not the first')


def is_no_pair(path: Path) -> bool:
    """Returns whether a file of a folder of baselines is no picture of its own: a sidecar, or a variant with a sidecar."""
    if path.name.endswith(SIDECAR_SUFFIX):
        return True
    name, mark, key = path.stem.partition(MARK)
    return bool(name and mark and KEY.fullmatch(key)) and sidecar_path(path).is_file()


def sidecar_path(picture: Path) -> Path:
    """Returns the path of a picture's sidecar, which need not exist."""
    return picture.with_name(picture.name + SIDECAR_SUFFIX)


def with_key(name: str, key: str) -> str:
    """Returns the path of a variant in the folder of baselines."""
    path = PurePosixPath(name)
    return str(path.with_name(f"{path.stem}{MARK}{key}{path.suffix}")) if key else name
