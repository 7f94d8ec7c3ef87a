"""baked: the vertices of each mesh are where the object's transform puts them, and the object has no transform."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.scene.object import Object
from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import (
    flattened,
    material_of,
    mesh_of,
    placed,
    shaded_smoothly,
    with_mesh,
    with_meshes,
    with_quality,
)


def _premise(scene: Scene) -> Scene:
    """Returns the scene without parents, shading per face and subdivision.

    Subdivision makes normals in object space, which a transform by unequal factors does not keep.
    """
    return with_quality(shaded_smoothly(flattened(scene)), subdivide=None)


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    def baked(item: Object) -> Object | None:
        material = material_of(scene, item)
        # Tangents are means over triangles in object space, which a transform by unequal factors does not keep.
        if material.needs_tangents or material.normal_map is not None or material.bump_map is not None:
            return None
        matrix = item.transform.array()
        mesh = _transformed(with_normals(mesh_of(item), item.normals, item.threshold), matrix)
        return placed(with_mesh(item, mesh), np.eye(4)).model_copy(update={"normals": "auto"})

    return draw(with_meshes(scene, baked))


def _transformed(mesh: Mesh, matrix: NDArray[np.float64]) -> Mesh:
    """Returns a mesh with normals, transformed by a matrix (4, 4)."""
    assert mesh.normals is not None
    linear = matrix[:3, :3]
    positions = (mesh.positions + mesh.origin) @ linear.T + matrix[:3, 3]
    # A normal stays perpendicular to its surface if the inverse transpose transforms it.
    normals = mesh.normals.astype(np.float64) @ np.linalg.inv(linear)
    # A mirrored triangle has its corners in the other order.
    triangles = mesh.triangles if np.linalg.det(linear) > 0 else mesh.triangles[:, ::-1]
    return Mesh.build(positions, triangles, normals, mesh.uvs, mesh.colours)


LAW = Law(
    name="baked",
    description="the vertices are transformed in place of the objects",
    picture=_picture,
    premise=_premise,
)
