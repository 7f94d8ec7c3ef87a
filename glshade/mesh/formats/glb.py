"""GLB: the binary form of glTF 2, one file that holds the JSON and its first buffer."""

from __future__ import annotations

from glshade.mesh.formats import gltf
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.gltf_container import MAGIC


def read(file: MeshFile) -> None:
    """Reads a GLB file and adds its meshes and materials to `file.contents`. Errors: AssetError."""
    if not file.data.startswith(MAGIC):
        raise file.fail("is not a GLB file: it does not start with 'glTF'")
    gltf.read(file)
