"""Mesh contents: reads a mesh file that a test has just written, and looks at what the reader found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from glshade.errors import AssetError
from glshade.limits import DEFAULT, Limits
from glshade.mesh.formats import read
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading.contents import Contents
from glshade.mesh.reading.file import MeshFile

# A PNG file with one pixel.
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de"
    "0000000c4944415408d763f8cfc000000301010018dd8db00000000049454e44ae426082"
)


def read_mesh(name: str, data: bytes | str, folder: Path = Path("/nowhere"), limits: Limits = DEFAULT) -> Contents:
    """Returns what the reader for the suffix of `name` finds in a file with this data. The file itself is not needed.

    folder: the folder that holds the files which the data names.
    Errors: AssetError.
    """
    raw = data.encode() if isinstance(data, str) else data
    return read(MeshFile(Path(name), folder, raw, limits=limits, folders=frozenset({folder})))


def complaint(name: str, data: bytes) -> str:
    """Returns the message of the reader about a file with this data; an empty text where it reads the file.

    Errors: whatever the reader raises that is no AssetError.
    """
    try:
        read_mesh(name, data)
    except AssetError as error:
        return str(error)
    return ""


def mesh_of(found: Contents, part: int = 0) -> Mesh:
    """Returns the mesh of a part."""
    return found.meshes[found.parts[part]["mesh"]]


def places(mesh: Mesh) -> Any:
    """Returns the positions (V, 3) of a mesh in object space, float64."""
    return mesh.positions + mesh.origin


def corners(found: Contents, part: int = 0) -> Any:
    """Returns the positions (T, 3, 3) of the triangles' corners of a part, in file space."""
    mesh = mesh_of(found, part)
    matrix = np.array(found.parts[part]["transform"])
    return (places(mesh) @ matrix[:3, :3].T + matrix[:3, 3])[mesh.triangles]


def area(found: Contents) -> float:
    """Returns the area of all parts, in which triangles of the plane z = 0 count negatively if they are clockwise."""
    total = 0.0
    for part in range(len(found.parts)):
        a, b, c = np.moveaxis(corners(found, part), 1, 0)
        total += float(np.cross(b - a, c - a)[:, 2].sum() / 2)
    return total


def colours(found: Contents, part: int = 0) -> Any:
    """Returns the colours (T, 3, 4) of the triangles' corners of a part, which must have some."""
    mesh = mesh_of(found, part)
    assert mesh.colours is not None
    return mesh.colours[mesh.triangles]


def uvs(found: Contents, part: int = 0) -> Any:
    """Returns the uvs (T, 3, 2) of the triangles' corners of a part, which must have some."""
    mesh = mesh_of(found, part)
    assert mesh.uvs is not None
    return mesh.uvs[mesh.triangles]
