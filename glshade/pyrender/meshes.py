"""Meshes of pyrender's primitives: triangles as they are, points and lines as strips that face the viewer."""

from __future__ import annotations

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

POINTS, LINES, LOOP, LINE_STRIP, TRIANGLES, STRIP, FAN = range(7)

# What was made of a primitive, and the arrays that it was made of. pyrender uploads them once; a new array counts as a change.
_meshes: WeakKeyDictionary[Any, tuple[tuple[Any, ...], Mesh]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Screen:
    """What points and lines need to know: pixels. size: (width, height); point_size [pixels]."""

    view: View
    size: tuple[int, int]
    point_size: float = 1.0

    @property
    def key(self) -> tuple[Any, ...]:
        """Equal for screens that show the same."""
        view = self.view
        seen = (view.perspective, view.eye.tobytes(), view.axes.tobytes(), view.half_width, view.half_height, view.near)
        return (*seen, self.size, self.point_size)


def is_drawn_with_strokes(primitive: Any) -> bool:
    """Whether it is points or lines."""
    return bool(primitive.mode < TRIANGLES)


def arrays(primitive: Any) -> tuple[Any, ...]:
    """All that a mesh is made of."""
    p = primitive
    return p.positions, p.indices, p.normals, p.texcoord_0, p.color_0, p.mode


def mesh(primitive: Any) -> Mesh | None:
    """The triangles of a primitive; None where it has none. Errors: AssetError."""
    given = arrays(primitive)
    known = _meshes.get(primitive)
    if known is not None and all(one is other for one, other in zip(known[0], given, strict=True)):
        return known[1]
    triangles = _triangles(_order(primitive), primitive.mode)
    if not len(triangles):
        return None
    # pyrender's texture coordinates start at the bottom left too; its vertex colours are linear.
    made = Mesh.build(primitive.positions, triangles, primitive.normals, primitive.texcoord_0, primitive.color_0)
    _meshes[primitive] = given, made
    return made


def _order(primitive: Any) -> Indices:
    """The vertices in the order in which GL is given them."""
    if primitive.indices is None:
        return np.arange(len(primitive.positions))
    order: Indices = np.asarray(primitive.indices).reshape(-1).astype(np.int64)
    return order


def _triangles(order: Indices, mode: int) -> Indices:
    """(T, 3)."""
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    first = order[: max(len(order) - 2, 0)]
    second, third = order[1 : 1 + len(first)], order[2:]
    if mode == FAN:
        return np.stack([np.broadcast_to(order[:1], first.shape), second, third], axis=1)
    # Every other triangle of a strip is turned, so that all wind alike.
    odd = np.arange(len(first)) % 2 == 1
    return np.stack([np.where(odd, second, first), np.where(odd, first, second), third], axis=1)


def strokes(primitive: Any, pose: Array, screen: Screen) -> Mesh | None:
    """Points as squares point_size wide, lines as strips one pixel wide, in world space; None where none is in front.

    Without normals they are lit as if they faced the viewer, as in pyrender.
    """
    view = screen.view
    order = _order(primitive)
    places = np.asarray(primitive.positions, dtype=np.float64) @ pose[:3, :3].T + pose[:3, 3]
    if primitive.mode == POINTS:
        # Both ends are the point; the corners lie to its left and right, below and above.
        ends = np.stack([order, order], axis=1)
        across = along = screen.point_size / 2
    else:
        ends = _segments(order, primitive.mode)
        across, along = 0.5, 0.0
    a, b, shares, shown = _in_front(view, places[ends[:, 0]], places[ends[:, 1]])
    a, b, shares, ends = a[shown], b[shown], shares[shown], ends[shown]
    if not len(ends):
        return None
    pixel_a, pixel_b = (_pixel(screen, p) for p in (a, b))
    if primitive.mode == POINTS:
        direction = np.broadcast_to([1.0, 0.0], (len(ends), 2))
    else:
        difference = (pixel_b - pixel_a) * screen.size
        length = np.linalg.norm(difference, axis=1, keepdims=True)
        # A line that is seen end on has no direction, and no length.
        direction = np.divide(difference, length, out=np.zeros_like(difference), where=length > 0)
    sideways = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    corners, sources = [], []
    for end, sign_along, sign_across in ((0, -1, -1), (1, 1, -1), (1, 1, 1), (0, -1, 1)):
        p = (a, b)[end]
        offset = sign_along * along * direction + sign_across * across * sideways
        corners.append(p + (offset * _pixel_size(screen, p)) @ view.axes[:2])
        sources.append(shares[:, end])
    # Four corners a stroke, counter-clockwise as seen.
    positions = np.stack(corners, axis=1).reshape(-1, 3)
    share = np.stack(sources, axis=1).reshape(-1, 1)
    first = 4 * np.arange(len(ends))[:, None]
    triangles = (first + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)

    def carried(values: Any) -> Array | None:
        """Each corner's value, between those of the two ends."""
        if values is None:
            return None
        values = np.asarray(values, dtype=np.float64)
        one, other = (np.repeat(values[ends[:, i]], 4, axis=0) for i in (0, 1))
        result: Array = one + share * (other - one)
        return result

    normals = carried(primitive.normals)
    if normals is not None:
        normals = normals @ normal_matrix(pose[:3, :3]).T
    elif view.perspective:
        normals = view.eye - positions
    else:
        normals = np.broadcast_to(view.axes[2], positions.shape)
    return Mesh.build(positions, triangles, normals, carried(primitive.texcoord_0), carried(primitive.color_0))


def _segments(order: Indices, mode: int) -> Indices:
    """(L, 2)."""
    if mode == LINES:
        return order[: len(order) // 2 * 2].reshape(-1, 2)
    closed = np.append(order, order[:1]) if mode == LOOP else order
    return np.stack([closed[:-1], closed[1:]], axis=1)


def _in_front(view: View, a: Array, b: Array) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """The parts beyond the near plane: (a, b, shares (N, 2) of the way from a to b where they begin and end, any left)."""
    near_a, near_b = view.depth(a) - view.near, view.depth(b) - view.near
    shown = (near_a >= 0) | (near_b >= 0)
    cut = np.divide(near_a, near_a - near_b, out=np.zeros_like(near_a), where=near_a != near_b)
    start, stop = np.where(near_a < 0, cut, 0.0), np.where(near_b < 0, cut, 1.0)
    return a + start[:, None] * (b - a), a + stop[:, None] * (b - a), np.stack([start, stop], axis=1), shown


def _pixel_size(screen: Screen, points: Array) -> Array:
    """(N, 2): how wide and high a pixel is at the depth of the points (N, 3) [scene units]."""
    view = screen.view
    size = 2 * np.array([view.half_width, view.half_height]) / screen.size
    deep = view.depth(points)[:, None] if view.perspective else np.ones((len(points), 1))
    return deep * size


def _pixel(screen: Screen, points: Array) -> Array:
    """(N, 2): where the points (N, 3) are, as shares of the picture's width and height; x to the right, y up."""
    view = screen.view
    flat = (points - view.eye) @ view.axes[:2].T
    result: Array = flat / (_pixel_size(screen, points) * screen.size)
    return result
