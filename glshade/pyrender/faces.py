"""Faces: objects whose colours are the numbers of their triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import SceneError
from glshade.mesh.mesh import Mesh
from glshade.pyrender.materials import WHITE, silhouette
from glshade.pyrender.meshes import corners, is_drawn_with_strokes
from glshade.pyrender.scene import in_order, instances, placed_object
from glshade.scene.object import Object

Numbers = NDArray[np.int32]
# A node of pyrender, the number of the primitive in its mesh, and the number of the instance.
Surface = tuple[Any, int, int]
# Three channels of 8 bits hold this many codes. The code 0 stands for the background.
CODES = 1 << 24


def numbered(scene: Any, both: bool) -> tuple[list[Object], list[Surface], NDArray[np.int64]]:
    """Returns (objects, surfaces (N), starts (N,)). The colour of a triangle of surface i is the code starts[i] + its number.

    scene: a pyrender.Scene.
    both: True to draw back faces even where a material does not ask for it.
    Errors: SceneError for too many triangles.
    """
    objects: list[Object] = []
    surfaces: list[Surface] = []
    starts: list[int] = []
    following = 1
    for node, pose in in_order(scene, scene.mesh_nodes):
        for number, primitive in enumerate(node.mesh.primitives):
            if is_drawn_with_strokes(primitive):
                continue
            triangles = corners(primitive)
            for instance, world in enumerate(instances(primitive, pose)):
                if following + len(triangles) > CODES:
                    raise SceneError(f"the scene has more than {CODES - 1:,} triangles, which is the most that can be numbered")
                shape = _coloured(primitive, triangles, following)
                item = None if shape is None else placed_object(shape, silhouette(primitive, WHITE, both), world, True)
                if item is not None:
                    objects.append(item)
                    surfaces.append((node, number, instance))
                    starts.append(following)
                following += len(triangles)
    return objects, surfaces, np.array(starts, dtype=np.int64)


def _coloured(primitive: Any, triangles: NDArray[np.integer[Any]], first: int) -> Mesh | None:
    """Returns the mesh of triangles (T, 3) that share no corners, in the colours of the codes from `first`; None if empty."""
    positions = np.asarray(primitive.positions)
    finite = np.isfinite(positions).all(axis=1)[triangles].all(axis=1)
    codes = (first + np.flatnonzero(finite))[:, None] >> np.array([0, 8, 16]) & 255
    order = triangles[finite].reshape(-1)
    if not len(order):
        return None
    uvs = None if primitive.texcoord_0 is None else np.asarray(primitive.texcoord_0)[order]
    colours = np.ones((len(order), 4))
    colours[:, :3] = np.repeat(codes / 255, 3, axis=0)
    return Mesh.build(positions[order], np.arange(len(order)).reshape(-1, 3), None, uvs, colours)


def decoded(pixels: NDArray[np.uint8], starts: NDArray[np.int64]) -> tuple[Numbers, Numbers]:
    """Returns (triangle (H, W), surface (H, W)) from colours (H, W, 3); -1 is the background. starts: as `numbered` returns."""
    codes = pixels.astype(np.int64) @ np.array([1, 1 << 8, 1 << 16])
    surface = np.searchsorted(starts, codes, side="right") - 1
    triangle = codes - np.append(starts, 1)[surface]
    return triangle.astype(np.int32), surface.astype(np.int32)
