"""triangles-reordered: the triangles and vertices of each mesh are listed in another order."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.object import Object
from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import mesh_of, with_mesh, with_meshes


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    return draw(with_meshes(scene, _reversed))


def _reversed(item: Object) -> Object:
    """Returns the object with its vertices and triangles in reverse order, and each triangle starting at another corner."""
    mesh = mesh_of(item)
    attributes = [field.name for field in fields(mesh) if field.name not in ("triangles", "origin", "neighbours")]
    arrays = {name: getattr(mesh, name)[::-1] for name in attributes if getattr(mesh, name) is not None}
    last = len(mesh.positions) - 1
    triangles = np.uint32(last) - mesh.triangles[::-1, [1, 2, 0]]
    return with_mesh(item, replace(mesh, triangles=triangles, **arrays))


LAW = Law(name="triangles-reordered", description="the triangles and vertices are listed in reverse order", picture=_picture)
