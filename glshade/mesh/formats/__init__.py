"""Mesh formats: each module here reads one format and is named after its suffix. A new file adds a format; no list names it.

A reader is a module with a function `read(file: MeshFile) -> None` that adds the meshes of the file to `file.contents`
(glshade/mesh/reading/file.py). It is imported when a file with its suffix is first read.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from glshade.errors import AssetError

if TYPE_CHECKING:
    from glshade.mesh.reading.contents import Contents

# The suffixes of all mesh formats, with the dot, in lower case and sorted.
SUFFIXES = tuple(sorted(f".{path.stem}" for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))


def read(path: Path, folder: Path, data: bytes) -> Contents:
    """Returns the contents of a mesh file.

    path: the file as the user wrote it, for messages; its suffix is one of SUFFIXES.
    folder: the absolute path of the folder in which the file finds its materials, textures and buffers.
    data: the bytes of the file.

    Errors: AssetError, one line that starts with the path, if the file is broken or holds nothing to draw.
    """
    import importlib

    from glshade.mesh.reading.file import MeshFile
    from glshade.mesh.reading.parser import quiet

    suffix = path.suffix.lower()
    file = MeshFile(path, folder, data)
    try:
        with quiet():
            importlib.import_module(f"glshade.mesh.formats{suffix}").read(file)
    except AssetError:
        raise
    except Exception as error:  # a parser may raise anything on broken input, and the user gets one line that names the file
        detail = f"{type(error).__name__}: {error}".rstrip(": ")
        raise file.fail(f"not a readable {suffix[1:].upper()} file ({detail[:200]})") from error
    if not file.contents.parts:
        raise file.fail("holds no triangles")
    return file.contents
