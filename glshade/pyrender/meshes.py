"""Meshes: converts pyrender's primitives into meshes; lines become strips that face the viewer."""

from __future__ import annotations

import operator
from typing import Any, Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.strokes import Viewport, strips
from glshade.assembly.values import normal_matrix
from glshade.mesh.mesh import Mesh
from glshade.mesh.strokes import DirectedPoints, build_strokes, segments

Array = NDArray[np.float64]
Indices = NDArray[np.integer[Any]]

# The modes of primitives, with the numbers that glTF and OpenGL give them.
POINTS, LINES, LOOP, LINE_STRIP, TRIANGLES, STRIP, FAN = range(7)

# primitive -> (the arrays that its mesh was made from, the mesh). A mesh is made again only for new array objects, not for new
# values in an array: pyrender, too, uploads an array once.
_meshes: WeakKeyDictionary[Any, tuple[tuple[Any, ...], Mesh]] = WeakKeyDictionary()


def is_drawn_with_strokes(primitive: Any) -> bool:
    """Returns whether a primitive consists of points or lines."""
    return bool(primitive.mode < TRIANGLES)


def is_drawn_with_points(primitive: Any) -> bool:
    """Returns whether a primitive consists of points."""
    return bool(primitive.mode == POINTS)


def arrays(primitive: Any) -> tuple[Any, ...]:
    """Returns all attributes of a primitive that its mesh depends on."""
    p = primitive
    return p.positions, p.indices, p.normals, p.texcoord_0, p.color_0, p.mode


def mesh(primitive: Any) -> Mesh | None:
    """Returns the mesh of a primitive of triangles; None if it has no triangle.

    The mesh is the same object in each call until the primitive changes.

    Errors: AssetError.
    """
    sources = arrays(primitive)
    known = _meshes.get(primitive)
    if known is not None and all(map(operator.is_, known[0], sources)):
        return known[1]
    triangles = corners(primitive)
    positions = np.asarray(primitive.positions)
    finite = _finite(positions)
    if not finite.all():
        triangles = triangles[finite[triangles].all(axis=1)]
        # No triangle uses these vertices any more; 0 stands for numbers that a mesh must not have.
        positions = np.where(finite[:, None], positions, 0)
    if not len(triangles):
        return None
    # As in glshade, texture coordinates start at the bottom left and vertex colours are linear.
    result = Mesh.build(positions, triangles, primitive.normals, primitive.texcoord_0, primitive.color_0)
    _meshes[primitive] = sources, result
    return result


def corners(primitive: Any) -> Indices:
    """Returns the vertices (T, 3) of all triangles of a primitive of triangles."""
    return _triangles(_order(primitive), primitive.mode)


def lost_triangles(primitive: Any) -> int:
    """Returns how many triangles of a primitive of triangles have a corner that is not finite."""
    finite = _finite(np.asarray(primitive.positions))
    return 0 if finite.all() else int((~finite[corners(primitive)].all(axis=1)).sum())


def _finite(positions: NDArray[Any]) -> NDArray[np.bool_]:
    """Returns whether each position (V, 3) is finite (V,)."""
    x, y, z = np.isfinite(positions).T  # NumPy is slow along an axis of three
    result: NDArray[np.bool_] = x & y & z
    return result


def _order(primitive: Any) -> Indices:
    """Returns the indices (N,) of the vertices in the order in which they are drawn, as integers of any type."""
    if primitive.indices is None:
        return np.arange(len(primitive.positions))
    order = np.asarray(primitive.indices).reshape(-1)
    # A copy of a large mesh's indices would take longer than the checks that follow.
    return order if order.dtype.kind in "iu" else order.astype(np.int64)


def _triangles(order: Indices, mode: int) -> Indices:
    """Returns the triangles (T, 3) that OpenGL assembles from vertices (N,) in a mode of triangles, strips or fans."""
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    first = order[: max(len(order) - 2, 0)]
    second, third = order[1 : 1 + len(first)], order[2:]
    if mode == FAN:
        return np.stack([np.broadcast_to(order[:1], first.shape), second, third], axis=1)
    # Every other triangle of a strip has two corners exchanged, so that all have the same winding.
    odd = np.arange(len(first)) % 2 == 1
    return np.stack([np.where(odd, second, first), np.where(odd, first, second), third], axis=1)


def points(primitive: Any) -> tuple[Mesh | None, int]:
    """Returns the mesh of a primitive of points, and the number of points that were left out because they are not finite.

    As in pyrender, normals do not turn to the viewer, and points without normals are lit as if they faced the viewer. The mesh
    is None if no point is left.
    Errors: AssetError.
    """
    p = primitive
    order = _order(p)
    finite = _finite(np.asarray(p.positions))
    if not finite[order].any():
        return None, len(order)
    mesh, lost = build_strokes(p.positions, np.stack([order, order], axis=1), p.normals, p.texcoord_0, p.color_0)
    return DirectedPoints.of(mesh), lost


def strokes(primitive: Any, pose: Array, screen: Viewport) -> Mesh | None:
    """Returns the mesh in world space of a primitive of lines; None if all of them are behind the near plane.

    Lines become strips one pixel wide. As in pyrender, a primitive without normals is lit as if it faced the viewer.

    primitive: a pyrender.Primitive.
    pose: (4, 4), from the primitive's space to world space.
    screen: the picture in which the strips are one pixel wide.
    """
    view = screen.view
    positions = np.asarray(primitive.positions, dtype=np.float64) @ pose[:3, :3].T + pose[:3, 3]
    made = strips(screen, positions, _ends(_order(primitive), primitive.mode))
    if not len(made.ends):
        return None
    uvs, colours, normals = (
        None if values is None else made.interpolated(values)
        for values in (primitive.texcoord_0, primitive.color_0, primitive.normals)
    )
    if normals is not None:
        normals = normals @ normal_matrix(pose[:3, :3]).T
    elif view.perspective:
        normals = view.eye - made.vertices
    else:
        normals = np.broadcast_to(view.axes[2], made.vertices.shape)
    return Mesh.build(made.vertices, made.triangles, normals, uvs, colours)


def _ends(order: Indices, mode: int) -> Indices:
    """Returns the vertices (S, 2) that the lines of a primitive join. order: the vertices (N,) in drawing order."""
    kind: Literal["lines", "strip", "loop"] = "lines" if mode == LINES else "loop" if mode == LOOP else "strip"
    lines = segments(order, kind)
    # OpenGL draws nothing for a line from a vertex to itself.
    visible: Indices = lines[lines[:, 0] != lines[:, 1]]
    return visible
