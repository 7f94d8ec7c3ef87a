"""Contents: what a mesh file held, in the form in which the cache keeps it."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from glshade.mesh.mesh import Float64, Mesh, ordered

Material: TypeAlias = dict[str, Any]

# Marks a texture that is a file of the cache entry itself: `embedded:NAME`.
EMBEDDED = "embedded:"


class Contents:
    """Meshes, parts, pictures, and what else was looked at on the way.

    parts: each with name, mesh (an index), transform (rows) and material.
    images: file name -> bytes, of pictures that the file embeds.
    dependencies: file -> sha256 of its bytes, "present" where only its presence counts, None where it was missing.
    """

    def __init__(self) -> None:
        self.meshes: list[Mesh] = []
        self.parts: list[dict[str, Any]] = []
        self.images: dict[str, bytes] = {}
        self.dependencies: dict[str, str | None] = {}
        self.warnings: list[str] = []

    def add(self, name: str, mesh: Mesh | int, material: Material | None = None, transform: Float64 | None = None) -> None:
        """Add a part; a mesh already added is given by its index."""
        if isinstance(mesh, Mesh):
            self.meshes.append(ordered(mesh))
            mesh = len(self.meshes) - 1
        taken = {part["name"] for part in self.parts}
        unique, count = name, 1
        while unique in taken:
            count += 1
            unique = f"{name}.{count}"
        rows = (np.eye(4) if transform is None else transform).tolist()
        self.parts.append({"name": unique, "mesh": mesh, "transform": rows, "material": material})
