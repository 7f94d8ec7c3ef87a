"""Meshes: converts pyrender's primitives into meshes; points and lines become squares and strips that face the viewer."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.values import normal_matrix
from glshade.mesh.mesh import Mesh
from glshade.scene.camera import View

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# The modes of primitives, with the numbers that glTF and OpenGL give them.
POINTS, LINES, LOOP, LINE_STRIP, TRIANGLES, STRIP, FAN = range(7)

# primitive -> (the arrays that its mesh was made from, the mesh). A mesh is made again only for new array objects, not for new
# values in an array: pyrender, too, uploads an array once.
_meshes: WeakKeyDictionary[Any, tuple[tuple[Any, ...], Mesh]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Viewport:
    """The picture that decides how large a pixel is in world space, and so how wide points and lines are.

    view: the camera's view, which says where points of world space appear in the picture.
    size: width, height [pixels].
    point_size: the side of the squares that points become [pixels].
    """

    view: View
    size: tuple[int, int]
    point_size: float = 1.0

    @property
    def key(self) -> tuple[Any, ...]:
        """A key for caches. It is equal for two viewports if points and lines become the same meshes in both."""
        view = self.view
        seen = (view.perspective, view.eye.tobytes(), view.axes.tobytes(), view.half_width, view.half_height, view.near)
        return (*seen, self.size, self.point_size)


def is_drawn_with_strokes(primitive: Any) -> bool:
    """Returns whether a primitive consists of points or lines."""
    return bool(primitive.mode < TRIANGLES)


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
    triangles = _triangles(_order(primitive), primitive.mode)
    if not len(triangles):
        return None
    # As in glshade, texture coordinates start at the bottom left and vertex colours are linear.
    result = Mesh.build(primitive.positions, triangles, primitive.normals, primitive.texcoord_0, primitive.color_0)
    _meshes[primitive] = sources, result
    return result


def _order(primitive: Any) -> Indices:
    """Returns the indices (N,) of the vertices in the order in which they are drawn."""
    if primitive.indices is None:
        return np.arange(len(primitive.positions))
    order: Indices = np.asarray(primitive.indices).reshape(-1).astype(np.int64)
    return order


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


def strokes(primitive: Any, pose: Array, screen: Viewport) -> Mesh | None:
    """Returns the mesh in world space of a primitive of points or lines; None if all of them are behind the near plane.

    Points become squares, and lines become strips one pixel wide. As in pyrender, a primitive without normals is lit as if it
    faced the viewer.

    primitive: a pyrender.Primitive.
    pose: (4, 4), from the primitive's space to world space.
    screen: the picture in which the strips are one pixel wide.
    """
    view = screen.view
    order = _order(primitive)
    positions = np.asarray(primitive.positions, dtype=np.float64) @ pose[:3, :3].T + pose[:3, 3]
    if primitive.mode == POINTS:
        # A point is treated as a horizontal line whose two ends coincide. Its square extends by half its side along that line
        # and across it.
        ends = np.stack([order, order], axis=1)
        across = along = screen.point_size / 2
    else:
        ends = _segments(order, primitive.mode)
        across, along = 0.5, 0.0
    a, b, shares, visible = _in_front(view, positions[ends[:, 0]], positions[ends[:, 1]])
    a, b, shares, ends = a[visible], b[visible], shares[visible], ends[visible]
    if not len(ends):
        return None
    pixel_a, pixel_b = (_pixel(screen, p) for p in (a, b))
    if primitive.mode == POINTS:
        direction = np.broadcast_to([1.0, 0.0], (len(ends), 2))
    else:
        difference = (pixel_b - pixel_a) * screen.size
        length = np.linalg.norm(difference, axis=1, keepdims=True)
        # A line whose ends cover the same point of the picture has no direction there. Its strip has no area.
        direction = np.divide(difference, length, out=np.zeros_like(difference), where=length > 0)
    sideways = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    corners, sources = [], []
    for end, sign_along, sign_across in ((0, -1, -1), (1, 1, -1), (1, 1, 1), (0, -1, 1)):
        p = (a, b)[end]
        offset = sign_along * along * direction + sign_across * across * sideways
        corners.append(p + (offset * _pixel_size(screen, p)) @ view.axes[:2])
        sources.append(shares[:, end])
    # Each point or line has four corners, counter-clockwise as the viewer sees them.
    vertices = np.stack(corners, axis=1).reshape(-1, 3)
    share = np.stack(sources, axis=1).reshape(-1, 1)
    first = 4 * np.arange(len(ends))[:, None]
    triangles = (first + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)

    def interpolated(values: Any) -> Array | None:
        """Interpolates values (N, C) of the primitive's vertices at the corners; returns None for None."""
        if values is None:
            return None
        values = np.asarray(values, dtype=np.float64)
        start, stop = (np.repeat(values[ends[:, i]], 4, axis=0) for i in (0, 1))
        result: Array = start + share * (stop - start)
        return result

    normals = interpolated(primitive.normals)
    if normals is not None:
        normals = normals @ normal_matrix(pose[:3, :3]).T
    elif view.perspective:
        normals = view.eye - vertices
    else:
        normals = np.broadcast_to(view.axes[2], vertices.shape)
    return Mesh.build(vertices, triangles, normals, interpolated(primitive.texcoord_0), interpolated(primitive.color_0))


def _segments(order: Indices, mode: int) -> Indices:
    """Returns the lines (L, 2) that OpenGL assembles from vertices (N,) in a mode of lines, strips or loops."""
    if mode == LINES:
        return order[: len(order) // 2 * 2].reshape(-1, 2)
    closed = np.append(order, order[:1]) if mode == LOOP else order
    return np.stack([closed[:-1], closed[1:]], axis=1)


def _in_front(view: View, a: Array, b: Array) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Clips lines at the near plane and returns (start (N, 3), end (N, 3), shares (N, 2), visible (N,)).

    a, b: (N, 3), the ends of the lines in world space.
    shares: the positions of start and end on the line from a (0) to b (1).
    visible: True where some part of the line is in front of the near plane.
    """
    near_a, near_b = view.depth(a) - view.near, view.depth(b) - view.near
    visible = (near_a >= 0) | (near_b >= 0)
    cut = np.divide(near_a, near_a - near_b, out=np.zeros_like(near_a), where=near_a != near_b)
    start, stop = np.where(near_a < 0, cut, 0.0), np.where(near_b < 0, cut, 1.0)
    return a + start[:, None] * (b - a), a + stop[:, None] * (b - a), np.stack([start, stop], axis=1), visible


def _pixel_size(screen: Viewport, points: Array) -> Array:
    """Returns the width and height (N, 2) of a pixel at the depths of points (N, 3) in world space [scene units]."""
    view = screen.view
    size = 2 * np.array([view.half_width, view.half_height]) / screen.size
    distance = view.depth(points)[:, None] if view.perspective else np.ones((len(points), 1))
    return distance * size


def _pixel(screen: Viewport, points: Array) -> Array:
    """Returns the positions (N, 2) of points (N, 3) in the picture, as shares of its width and height; x to the right, y up."""
    view = screen.view
    flat = (points - view.eye) @ view.axes[:2].T
    result: Array = flat / (_pixel_size(screen, points) * screen.size)
    return result
