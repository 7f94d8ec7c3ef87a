"""Clusters: neighbouring triangles that look the same way, so that those behind a solid are never handed to the GPU."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Instance
from glshade.mesh.mesh import Mesh, face_normals
from glshade.scene.camera import View

Array = NDArray[np.float64]

# Triangles a cluster: small enough to have one direction, large enough that asking costs less than drawing.
SIZE = 32
# Below this many triangles there is nothing to gain.
WORTHWHILE = 4096
# Rounding and sub-pixel snapping turn triangles that are seen edge-on; a cluster counts as hidden only beyond this sine.
EDGE_ON = 0.02


_cones_of: WeakKeyDictionary[Mesh, tuple[Array, Array, Array, Array]] = WeakKeyDictionary()


def _cones(mesh: Mesh) -> tuple[Array, Array, Array, Array]:
    """(axis (K, 3), sine (K,), middle (K, 3), radius (K,)) of each full cluster, in the mesh's own space.

    No normal leaves its axis by more than the sine's angle; a cluster that looks everywhere has a sine above 1.
    """
    count = len(mesh.triangles) // SIZE
    # One coordinate at a time: numpy is many times as fast along a long axis as along one of three.
    x, y, z = (np.ascontiguousarray(n).reshape(count, SIZE) for n in face_normals(mesh)[: count * SIZE].T)
    axis = np.stack([n.sum(axis=1) for n in (x, y, z)], axis=1)
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-30)
    narrowest = (x * axis[:, :1] + y * axis[:, 1:2] + z * axis[:, 2:]).min(axis=1)
    sine = np.where(narrowest > 0, np.sqrt(np.maximum(1 - narrowest**2, 0.0)), 2.0)
    corners = mesh.triangles[: count * SIZE].reshape(-1).astype(np.intp)
    middle = np.empty((count, 3))
    square = np.zeros((count, 3 * SIZE))
    for k in range(3):
        place = mesh.positions[:, k].astype(np.float64)[corners].reshape(count, -1)
        middle[:, k] = 0.5 * (place.min(axis=1) + place.max(axis=1))
        square += np.square(place - middle[:, k, None])
    return axis, sine, middle, np.sqrt(square.max(axis=1))


def facing(instance: Instance, view: View) -> NDArray[np.uint32] | None:
    """(N, 3) the triangles, without the clusters that show the viewer nothing but their backs; None: all of them.

    Shirman and Abi-Ezzi 1993's cone test, in the mesh's own space, where every affine transform keeps sides.
    """
    mesh = instance.mesh
    if instance.back_faces or len(mesh.triangles) < WORTHWHILE:
        return None
    if mesh not in _cones_of:
        _cones_of[mesh] = _cones(mesh)
    axis, sine, middle, radius = _cones_of[mesh]
    linear, translation = instance.world_from_object[:3, :3], instance.world_from_object[:3, 3]
    if view.perspective:
        away = middle - np.linalg.solve(linear, view.eye - translation)
        distance = np.linalg.norm(away, axis=1)
        hidden = np.einsum("ki,ki->k", away, axis) >= (sine + EDGE_ON) * distance + radius
    else:
        forward = np.linalg.solve(linear, -view.axes[2])
        hidden = axis @ (forward / np.linalg.norm(forward)) >= sine + EDGE_ON
    if not hidden.any():
        return None
    whole = len(hidden) * SIZE
    # A cluster at a time: numpy moves 32 triangles as fast as one.
    shown = mesh.triangles[:whole].reshape(-1, 3 * SIZE)[~hidden].reshape(-1, 3)
    return np.concatenate([shown, mesh.triangles[whole:]])
