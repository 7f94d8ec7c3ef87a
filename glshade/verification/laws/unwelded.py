"""unwelded: no two triangles of a mesh share a vertex."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.mesh.mesh import gather
from glshade.scene.object import Object
from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import mesh_of, with_mesh, with_meshes


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    return draw(with_meshes(scene, _unwelded))


def _unwelded(item: Object) -> Object:
    """Returns the object with a vertex for each corner of each triangle."""
    mesh = mesh_of(item)
    corners = mesh.triangles.reshape(-1)
    return with_mesh(item, gather(mesh, corners, np.arange(len(corners))))


LAW = Law(name="unwelded", description="triangles share no vertices", picture=_picture)
