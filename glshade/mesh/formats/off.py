"""OFF: the Object File Format, a list of vertices and a list of polygons. Its colours are not read."""

from __future__ import annotations

from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.parser import add_geometries


def read(file: MeshFile) -> None:
    """Adds the mesh of an OFF file. Errors: AssetError."""
    add_geometries(file, "off")
