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
    from glshade.mesh.reading.file import MeshFile

# The suffixes of all mesh formats, with the dot, in lower case and sorted.
SUFFIXES = tuple(sorted(f".{path.stem}" for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))


def read(file: MeshFile) -> Contents:
    """Returns the contents of a mesh file whose suffix is one of SUFFIXES.

    Errors: AssetError, one line that starts with the path, if the file is broken or holds nothing to draw.
    """
    import importlib
    import warnings

    from glshade.mesh.reading.textures import settle

    suffix = file.path.suffix.lower()
    try:
        # NumPy warns about numbers in the file; the readers report what matters in their own words.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            importlib.import_module(f"glshade.mesh.formats{suffix}").read(file)
    except AssetError:
        raise
    except Exception as error:  # a parser may raise anything on broken input, and the user gets one line that names the file
        kind = suffix[1:].upper()
        if isinstance(error, MemoryError):
            raise file.fail(f"reading this {kind} file takes more memory than there is") from error
        raise file.fail(
            f"is not a readable {kind} file: its parts do not fit together; is it damaged, or of another format?"
        ) from error
    for line in file.faults.lines():
        file.warn(line)
    if not file.contents.parts:
        raise file.fail("holds no triangles")
    settle(file)
    return file.contents
