"""Formats: what mesh files hold. One reader a module, imported when a file of its kind is read.

A reader is a module with `read(file: File) -> None`, which adds what it finds to `file.contents`. The geometry is parsed by
trimesh's loaders, called below the level at which it builds its own objects: those merge vertices, recompute normals
and turn colours into bytes.
"""

from __future__ import annotations

from pathlib import Path

from glshade.errors import AssetError
from glshade.mesh.formats.contents import Contents

# Suffix -> module.
READERS = {".obj": "obj", ".ply": "ply", ".stl": "plain", ".off": "plain", ".glb": "gltf", ".gltf": "gltf"}


def read(path: Path, folder: Path, data: bytes) -> Contents:
    """What a mesh file holds.

    path: as the user wrote it, for messages; folder: where it lies, absolute; data: its bytes.
    Raises AssetError, one line starting with the path: broken, or nothing in it to draw.
    """
    import importlib

    from glshade.mesh.formats.file import File
    from glshade.mesh.formats.parser import quiet

    suffix = path.suffix.lower()
    file = File(path, folder, data)
    try:
        with quiet():
            importlib.import_module(f"glshade.mesh.formats.{READERS[suffix]}").read(file)
    except AssetError:
        raise
    except Exception as error:  # a parser fails in any way on garbage; the user is told which file, in one line
        detail = f"{type(error).__name__}: {error}".rstrip(": ")
        raise file.fail(f"not a readable {suffix[1:].upper()} file ({detail[:200]})") from error
    if not file.contents.parts:
        raise file.fail("holds no triangles")
    return file.contents
