"""Parser: trimesh's loaders, without the objects that trimesh would build. Importing it takes more than half a second."""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from glshade.mesh.mesh import Array


def parse(kind: str, data: bytes, **options: Any) -> dict[str, Any]:
    """What trimesh's loader makes of the bytes: the keyword arguments for its own constructors."""
    from trimesh.exchange.load import mesh_loaders

    loaders: dict[str, Any] = mesh_loaders
    result: dict[str, Any] = loaders[kind](io.BytesIO(data), file_type=kind, **options)
    return result


def triangles(faces: Any) -> Array:
    """(T, 3) integers from triangles, quads or a mixture with polygons."""
    from trimesh.geometry import triangulate_quads

    return np.asarray(triangulate_quads(faces)).reshape(-1, 3)


@contextmanager
def quiet() -> Iterator[None]:
    """Neither warnings nor log lines of the parsers: what matters of them is said in our own words."""
    logger = logging.getLogger("trimesh")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)
