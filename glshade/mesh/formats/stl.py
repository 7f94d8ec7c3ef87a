"""STL: triangles, as text or in binary form. Its normals are not read: they belong to faces and follow from the positions."""

from __future__ import annotations

from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.parser import add_geometries


def read(file: MeshFile) -> None:
    """Reads an STL file and adds its meshes to `file.contents`. Errors: AssetError."""
    add_geometries(file, "stl")
