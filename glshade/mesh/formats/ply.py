"""PLY: the Stanford polygon format, with colours of vertices, and texture coordinates of vertices or of faces."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from glshade.arrays import Float64
from glshade.mesh.reading.colours import srgb_to_linear, with_alpha
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.parser import parse, triangles


def read(file: MeshFile) -> None:
    """Adds the mesh of a PLY file, with the texture that its comments name. Errors: AssetError."""
    # fix_texture would renumber the vertices, but not their normals and colours.
    parsed = parse("ply", file.data, skip_materials=True, fix_texture=False)
    if "vertices" not in parsed:
        raise file.fail("holds no vertices")
    if parsed.get("faces") is None or len(parsed["faces"]) == 0:
        raise file.fail("holds only points, no triangles")
    vertex = parsed["metadata"]["_ply_raw"]["vertex"]["data"]
    positions, normals, colours = parsed["vertices"], parsed.get("vertex_normals"), None
    if parsed.get("vertex_colors") is not None:
        raw = np.asarray(parsed["vertex_colors"])
        colours = raw / np.iinfo(raw.dtype).max if raw.dtype.kind == "u" else raw.astype(np.float64)
        colours = with_alpha(colours)
        if raw.dtype.itemsize == 1:  # bytes are sRGB-encoded by convention; wider types are taken as linear
            colours[:, :3] = srgb_to_linear(colours[:, :3])
    has = set(vertex.dtype.names if isinstance(vertex, np.ndarray) else vertex)
    uvs = None
    for u, v in (("s", "t"), ("u", "v"), ("texture_u", "texture_v")):
        if {u, v} <= has:
            uvs = np.column_stack([vertex[u], vertex[v]])
    faces = parsed["faces"]
    per_face = _face_uvs(parsed["metadata"]["_ply_raw"]["face"]["data"], np.shape(faces))
    if per_face is not None:
        corners = np.reshape(faces, -1)
        if corners.min() < 0 or corners.max() >= len(positions):
            raise file.fail(f"a face index is out of range: the mesh has {len(positions)} vertices")
        positions, uvs = positions[corners], per_face
        normals = None if normals is None else normals[corners]
        colours = None if colours is None else colours[corners]
        faces = np.arange(len(corners)).reshape(np.shape(faces))
    picture = re.search(rb"^comment\s+TextureFile\s+(.+?)\s*$", file.data[:4096], re.MULTILINE)
    material: Material | None = None
    if picture and uvs is not None:
        texture = file.texture(picture[1].decode("utf-8", "replace"))
        if texture:
            material = {"brdf": "lambert", "kd": {"texture": texture, "factor": [1.0, 1.0, 1.0]}}
    mesh = file.build("", positions, triangles(faces), normals=normals, uvs=uvs, colours=colours)
    file.contents.add(file.path.stem, mesh, material)


def _face_uvs(data: Any, shape: tuple[int, ...]) -> Float64 | None:
    """Returns the uvs (corners, 2) that a property `texcoord` gives to the corners of faces; None if there is none.

    data: the elements "face" as trimesh leaves them, which is either a structured array or a table.
    shape: the shape of the faces' indices.
    """
    try:
        raw = data["texcoord"]
        if isinstance(data, np.ndarray):
            raw = raw["f1"]
        uvs = np.asarray(raw, dtype=np.float64)
    except (KeyError, ValueError, IndexError, TypeError):
        return None
    return uvs.reshape(-1, 2) if len(shape) == 2 and uvs.shape == (shape[0], 2 * shape[1]) else None
