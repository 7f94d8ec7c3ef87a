"""Meshes: triangles with their normals, tangents and order; shapes that are computed from formulas; mesh files."""

from typing import TYPE_CHECKING

from glshade.found import lazily

if TYPE_CHECKING:
    from glshade.mesh.mesh import Mesh as Mesh

__getattr__ = lazily("glshade.mesh", {"Mesh": "mesh"})
