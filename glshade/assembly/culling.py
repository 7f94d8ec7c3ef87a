"""Culling: leaves out clusters of neighbouring triangles that turn their backs to the viewer, before they reach the GPU."""

from __future__ import annotations

from weakref import WeakKeyDictionary, WeakSet

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.instance import Instance
from glshade.assembly.strokes import Squares
from glshade.mesh.geometry import face_normals
from glshade.mesh.mesh import Mesh
from glshade.scene.camera import View

Array = NDArray[np.float64]

# The number of triangles in a cluster. The normals of fewer triangles differ less; more triangles make the test cheaper.
SIZE = 32
# A mesh with fewer triangles is drawn whole, because the test would cost more than it saves. With llvmpipe both ways take the
# same time at about 20,000 triangles, in pictures of 64 x 64 and of 256 x 256 pixels.
WORTHWHILE = 20_000
# The sine of a margin angle. Rounding and sub-pixel snapping may turn a triangle that is seen edge-on to the front. So a
# cluster counts as hidden only if it is turned away from the viewer by more than this angle.
EDGE_ON = 0.02

# The meshes that were drawn before. The cones of a mesh take longer than they save in one picture, so they are computed when it
# is drawn for the second time: a mesh that changes in every picture never gets any.
_drawn: WeakSet[Mesh] = WeakSet()
# mesh -> the cones of its clusters, for as long as the mesh exists.
_cones_of: WeakKeyDictionary[Mesh, tuple[Array, Array, Array, Array]] = WeakKeyDictionary()


def _cones(mesh: Mesh) -> tuple[Array, Array, Array, Array]:
    """Returns (axis (K, 3), sine (K,), middle (K, 3), radius (K,)) of the K full clusters, in object space.

    axis: the unit mean direction of the cluster's normals.
    sine: the sine of the largest angle between the axis and a normal; 2 if an angle is 90 degrees or more.
    middle, radius: the centre and the radius of the cluster's bounding sphere.
    """
    count = len(mesh.triangles) // SIZE
    # Each coordinate is handled by itself, since NumPy is many times faster along a long axis than along one of length 3.
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
    """Returns the triangles (N, 3) without the clusters whose triangles all turn their backs to the viewer.

    If all triangles are drawn, the result is None, as it always is for the first picture of a mesh. The cone test of Shirman
    and Abi-Ezzi 1993 is made in object space, because an affine transform keeps points on the same side of a triangle.
    """
    mesh = instance.mesh
    if instance.back_faces or isinstance(mesh, Squares) or len(mesh.triangles) < WORTHWHILE:
        return None
    if mesh not in _drawn:
        _drawn.add(mesh)
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
    # Whole clusters are selected as rows, since NumPy copies 32 triangles in a row as fast as one.
    visible = mesh.triangles[:whole].reshape(-1, 3 * SIZE)[~hidden].reshape(-1, 3)
    return np.concatenate([visible, mesh.triangles[whole:]])
