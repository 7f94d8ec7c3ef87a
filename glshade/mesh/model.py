"""Model: the parts of a mesh file, each with its mesh, its transform and its material."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from glshade.arrays import Float64
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading.contents import EMBEDDED, Contents, Material

# Modification time [ns] and size [bytes] of a file; None where the file is missing.
Stamp: TypeAlias = tuple[int, int] | None


@dataclass(frozen=True, eq=False)
class MeshPart:
    """One mesh of a file, where the file puts it.

    name: the part's name, unique within the file.
    mesh: the mesh. Parts that are instances of one mesh hold the same object.
    transform: (4, 4) float64, from object space to file space, with all nested transforms multiplied.
    material: a table as in a scene file, with colours as linear Rec. 709; None where the file has no material.
    """

    name: str
    mesh: Mesh
    transform: Float64
    material: Material | None


@dataclass(frozen=True, eq=False)
class Model:
    """All parts of a mesh file.

    parts: the parts in the order of the file.
    stamps: the stamp of every file that the model depends on, taken when the model was read.
    entry: the folder that holds the pictures which the mesh file embeds; None where it embeds none.
    cameras: name -> a camera of the file, as a table of a scene file in file space.
    lights: the lights of the file, as tables of a scene file in file space.
    """

    parts: tuple[MeshPart, ...]
    stamps: dict[Path, Stamp] = field(default_factory=dict)
    entry: Path | None = None
    cameras: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    lights: tuple[dict[str, Any], ...] = ()

    @property
    def nbytes(self) -> int:
        """The memory that the arrays of all meshes take [bytes]."""
        meshes = {id(part.mesh): part.mesh for part in self.parts}
        return sum(mesh.nbytes for mesh in meshes.values())

    @property
    def unchanged(self) -> bool:
        """Whether all files that the model depends on still have the stamps that they had."""
        return stamps(self.stamps) == self.stamps


def stamps(paths: Iterable[Path]) -> dict[Path, Stamp]:
    """Returns the stamp of each file, as it is now."""

    def stamp(path: Path) -> Stamp:
        try:
            stat = path.stat()
        except (OSError, ValueError):  # the file is missing, or no file can have the name
            return None
        return stat.st_mtime_ns, stat.st_size

    return {path: stamp(path) for path in paths}


def model_of(contents: Contents, folder: Path) -> Model:
    """Returns the model with the contents of a mesh file, whose embedded pictures lie in `folder`.

    Raises an exception of any type if the contents are damaged, as those of a cache entry may be.
    """
    pictures: list[Path] = []

    def placed(value: Any) -> Any:
        """Returns a material, with the absolute paths of its embedded pictures."""
        if isinstance(value, dict):
            return {key: placed(item) for key, item in value.items()}
        if isinstance(value, str) and value.startswith(EMBEDDED):
            pictures.append(folder / value.removeprefix(EMBEDDED))
            return str(pictures[-1])
        return value

    parts = []
    for part in contents.parts:
        transform = np.array(part["transform"], dtype=np.float64).reshape(4, 4)
        transform.flags.writeable = False
        parts.append(MeshPart(part["name"], contents.meshes[part["mesh"]], transform, placed(part["material"])))
    found = stamps([*map(Path, contents.dependencies), *pictures])
    return Model(tuple(parts), found, folder if pictures else None, contents.cameras, tuple(contents.lights))
