"""Parser: calls the file loaders of trimesh directly, so that trimesh does not build its own objects from their results.

To build them, trimesh would merge vertices, recompute normals and turn colours into bytes. The first call imports trimesh,
which takes more than half a second.
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from glshade.arrays import Array
from glshade.mesh.reading.file import MeshFile


def parse(kind: str, data: bytes, **options: Any) -> dict[str, Any]:
    """Parses the bytes of a file with trimesh's loader of a kind ("obj", "ply", "stl", "off" or "gltf").

    options: keyword arguments of that loader.
    Returns the keyword arguments that trimesh would give to its own constructors. Raises whatever the loader raises.
    """
    from trimesh.exchange.load import mesh_loaders

    loaders: dict[str, Any] = mesh_loaders
    result: dict[str, Any] = loaders[kind](io.BytesIO(data), file_type=kind, **options)
    return result


def triangles(faces: Any) -> Array:
    """Returns (T, 3) vertex indices from faces that are triangles, quads, or a mixture that may hold larger polygons."""
    from trimesh.geometry import triangulate_quads

    return np.asarray(triangulate_quads(faces)).reshape(-1, 3)


def add_geometries(file: MeshFile, kind: str) -> None:
    """Adds the triangles that trimesh's loader of this kind reads from a file. Everything else in the file is left out.

    Errors: AssetError.
    """
    parsed = parse(kind, file.data)
    geometries = parsed.get("geometry") or {file.path.stem: parsed}
    for name, geometry in geometries.items():
        if len(geometry.get("vertices", ())) and not len(geometry.get("faces", ())):
            raise file.fail("holds only points, no triangles")
        if len(geometry.get("faces", ())):
            mesh = file.build("", geometry["vertices"], triangles(geometry["faces"]))
            file.contents.add(name or file.path.stem, mesh)


@contextmanager
def quiet() -> Iterator[None]:
    """Suppresses the warnings and log lines of the parsers: the readers report what matters in their own words."""
    logger = logging.getLogger("trimesh")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)
