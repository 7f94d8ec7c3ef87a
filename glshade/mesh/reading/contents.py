"""Contents: the meshes, materials and pictures of a mesh file, in the form in which the cache folder stores them."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from glshade.arrays import Float64
from glshade.errors import printable
from glshade.mesh.mesh import Mesh
from glshade.mesh.order import ordered

# A material as in a scene file: the name of a model under "brdf", and its parameters.
Material: TypeAlias = dict[str, Any]

# The path of a texture that lies in the cache entry itself is written as this prefix and the name of the file.
EMBEDDED = "embedded:"


class Contents:
    """Everything that a reader found in a mesh file. All but the meshes and images can be written as JSON.

    meshes: the meshes, to which parts refer by index.
    parts: tables with the keys "name", "mesh" (an index), "transform" (a list of 4 rows) and "material" (or None).
    cameras: name -> a camera, as a table of a scene file in file space.
    lights: the lights, as tables of a scene file in file space.
    images: file name -> bytes, for each picture that the mesh file embeds.
    dependencies: path -> state, for each other file that was looked at. The state is the SHA-256 of the file's bytes, "present"
        where only the file's existence matters, or None where the file was missing.
    warnings: one line for each thing that is missing or not used.
    """

    def __init__(self) -> None:
        self.meshes: list[Mesh] = []
        self.parts: list[dict[str, Any]] = []
        self.cameras: dict[str, dict[str, Any]] = {}
        self.lights: list[dict[str, Any]] = []
        self.images: dict[str, bytes] = {}
        self.dependencies: dict[str, str | None] = {}
        self.warnings: list[str] = []
        # Name that was given or made -> the number that was last appended to it.
        self._used: dict[str, int] = {}

    def add(self, name: str, mesh: Mesh | int, material: Material | None = None, transform: Float64 | None = None) -> None:
        """Adds a part.

        name: a number is appended where another part has the same name. Control characters are replaced.
        mesh: a mesh, or the index of one that was added already.
        material: optional, in the form of a scene file.
        transform: (4, 4), from object space to file space. Default: the identity.
        """
        if isinstance(mesh, Mesh):
            self.meshes.append(ordered(mesh))
            mesh = len(self.meshes) - 1
        unique, count = printable(name), self._used.get(name, 1)
        while unique in self._used:
            count += 1
            unique = f"{printable(name)}.{count}"
        self._used[name] = count
        self._used.setdefault(unique, 1)
        rows = (np.eye(4) if transform is None else transform).tolist()
        self.parts.append({"name": unique, "mesh": mesh, "transform": rows, "material": material})
