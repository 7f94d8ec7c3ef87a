"""Strokes: turns points and lines into triangles that face the viewer, with sizes in pixels.

A driver that draws points by itself gets the centres of the squares instead, one vertex for each point.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Float32, UInt32
from glshade.mesh.mesh import Mesh
from glshade.mesh.strokes import DirectedPoints
from glshade.mesh.welding import normalised
from glshade.scene.camera import View
from glshade.scene.scene import Scene

Array = NDArray[np.float64]
Indices = NDArray[np.integer[Any]]
Flags = NDArray[np.bool_]

# The number of strokes that are turned into triangles at once. The intermediate arrays of so many take about 30 MB, and fit
# the caches of a processor better than those of a million strokes.
BATCH = 1 << 15
# The corners of the two triangles of a square or strip.
CORNERS = np.array([0, 1, 2, 0, 2, 3], dtype=np.uint32)
# A line counts as parallel to a side of the picture if its ends are off by less than this [pixels].
STRAIGHT = 1e-3


@dataclass(frozen=True, eq=False)
class Viewport:
    """The picture that decides how large a pixel is in world space, and so how wide points and lines are.

    view: the camera's view, which says where points of world space appear in the picture.
    size: width, height [pixels].
    point_size: the side of the squares that points become [pixels].
    line_width: the width of the strips that lines become [pixels].
    on_grid: whether the edges of squares, and of strips that are parallel to a side of the picture, lie between pixels. They
        then cover the same centres of pixels as without it. But no edge passes through a centre, where rounding would decide.
    """

    view: View
    size: tuple[int, int]
    point_size: float = 1.0
    line_width: float = 1.0
    on_grid: bool = False

    @property
    def key(self) -> tuple[Any, ...]:
        """A key for caches. It is equal for two viewports if points and lines become the same meshes in both."""
        view = self.view
        seen = (view.perspective, view.eye.tobytes(), view.axes.tobytes(), view.half_width, view.half_height, view.centre)
        return (*seen, view.near, view.far, self.size, self.point_size, self.line_width, self.on_grid)

    @property
    def corner(self) -> Array:
        """The place (2,) where the camera's axis meets the picture, from its bottom left corner, as shares of its size."""
        return 0.5 + np.array(self.view.centre) / 2


# mesh -> (key of a viewport, the meshes of triangles for that viewport by the bytes of their transforms). The meshes of older
# viewports are dropped, so that a moving camera does not fill the memory.
_drawn: WeakKeyDictionary[Mesh, tuple[tuple[Any, ...], dict[bytes, Mesh]]] = WeakKeyDictionary()


def has_strokes(scene: Scene) -> bool:
    """Returns whether a scene draws points or lines. Errors: AssetError for a mesh file that cannot be read."""
    load = scene.loader()
    for item in scene.objects:
        meshes = [part.mesh for part in load(item.mesh).parts] if isinstance(item.mesh, Path) else [item.own_mesh]
        if any(mesh is not None and mesh.strokes is not None for mesh in meshes):
            return True
    return False


def stroked(mesh: Mesh, world: Array, screen: Viewport) -> Mesh:
    """Returns the triangles of a mesh of points and lines in world space: squares and strips that face the viewer.

    The same object is returned for the same mesh, transform and viewport, as long as no other viewport was asked for. Strokes
    outside the picture are left out; where none is left, the mesh has one triangle without area. The origin of the mesh is the
    eye, so that float32 resolves a pixel at every depth. Normals turn to the viewer, and stand in for those that are missing.
    A mesh of points alone is faceted: each square has the normal of its point, and is shaded at its centre.

    mesh: a mesh with `strokes`.
    world: (4, 4), from the mesh's space to world space.
    screen: the picture in which the strokes have their sizes.
    """
    key, made = _drawn.get(mesh, ((), {}))
    if key != screen.key:
        made = {}
        _drawn[mesh] = screen.key, made
    place = world.tobytes()
    if place not in made:
        made[place] = Squares.of_points(Points(mesh, world, screen)) if is_points(mesh) else _stroked(mesh, world, screen)
    return made[place]


def is_points(mesh: Mesh) -> bool:
    """Returns whether a mesh consists of points alone."""
    return mesh.strokes is not None and bool((mesh.strokes[:, 0] == mesh.strokes[:, 1]).all())


class Points:
    """Points as a GPU draws them: each has one vertex, the centre of its square.

    mesh: the mesh of the points.
    world: (4, 4), from the mesh's space to world space.
    screen: the picture in which the squares have their size.
    """

    def __init__(self, mesh: Mesh, world: Array, screen: Viewport) -> None:
        self.mesh, self.world, self.screen = mesh, world, screen

    @property
    def count(self) -> int:
        """The number of points."""
        return 0 if self.mesh.strokes is None else len(self.mesh.strokes)

    @property
    def are_squares(self) -> bool:
        """Whether all points are squares of the same size in the picture, as a driver draws them.

        Between the pixels' edges, a square whose side is no whole number of pixels becomes a rectangle.
        """
        return not self.screen.on_grid or self.screen.point_size.is_integer()

    @property
    def order(self) -> UInt32 | None:
        """The vertices (S,) in the order in which they are drawn; None where all are drawn once, one after the other."""
        assert self.mesh.strokes is not None
        order = self.mesh.strokes[:, 0]
        in_turn = len(order) == len(self.mesh.positions) and bool((order[1:] == order[:-1] + 1).all())
        return None if in_turn and not order[0] else np.ascontiguousarray(order)

    @cached_property
    def centres(self) -> Float32:
        """(V, 3), the centres of the squares in world space, relative to the eye."""
        result = np.empty(self.mesh.positions.shape, dtype=np.float32)
        turned = self.world[:3, :3].T
        offset = self.mesh.origin @ turned + self.world[:3, 3]
        for start in range(0, len(result), BATCH):
            rows = slice(start, start + BATCH)
            positions = self.mesh.positions[rows] @ turned + offset
            result[rows] = _centred_on_grid(self.screen, positions) - self.screen.view.eye
        return _owned(result)

    @cached_property
    def normals(self) -> Float32:
        """(V, 3), the unit normals in world space; the direction to the viewer where there is none.

        Unless they are directed, they are on the viewer's side.
        """
        view, given = self.screen.view, self.mesh.normals
        result = np.empty(self.mesh.positions.shape, dtype=np.float32)
        result[:] = view.axes[2]
        for start in range(0, len(result), BATCH) if given is not None else ():
            rows = slice(start, start + BATCH)
            facing = result[rows].astype(np.float64)
            if view.perspective:
                facing = normalised(-self.centres[rows].astype(np.float64))[0]
            own = given[rows] if given is not None else facing
            result[rows] = self._directed(own, facing) if own.any() else facing
        return _owned(result)

    def _directed(self, normals: NDArray[Any], facing: Array) -> Array:
        """Returns normals (N, 3) in world space, from those of the mesh. facing: (N, 3), the directions to the viewer."""
        linear = self.world[:3, :3]
        if not isinstance(self.mesh, DirectedPoints):
            return _turned(normals @ _cofactors(linear), facing)
        unit, length = normalised(normals @ (_cofactors(linear) * np.linalg.slogdet(linear)[0]))
        return np.where(length[:, None] > 0, unit, facing)

    def array(self, name: str) -> Float32 | None:
        """Returns the values (V, n) of the vertices for an array of `Mesh`; None if the points have none."""
        if name in ("positions", "centroids"):
            return self.centres
        if name == "normals":
            return self.normals
        return {"uvs": self.mesh.uvs, "colours": self.mesh.colours}.get(name.removeprefix("centroid_"))


# The arrays of `Mesh` that the squares of points may have, except their corners.
_OF_POINTS = ("normals", "uvs", "colours", "centroids", "centroid_uvs", "centroid_colours")


class Squares(Mesh):
    """The squares of points. Their arrays are made when somebody asks for one; a driver that draws points by itself does not.

    points: the points; None for a changed copy, whose arrays are there already.
    """

    points: Points | None = None

    @classmethod
    def of_points(cls, points: Points) -> Squares:
        """Returns the squares of points."""
        squares = object.__new__(cls)
        vars(squares).update(points=points, origin=points.screen.view.eye)
        return squares

    @property
    def counts(self) -> tuple[int, int]:
        return super().counts if self.points is None else (4 * self.points.count, 2 * self.points.count)

    @cached_property
    def _made(self) -> Mesh:
        assert self.points is not None
        return _stroked(self.points.mesh, self.points.world, self.points.screen, self.points)


def _delegated(name: str) -> Any:
    """Returns the property of `Squares` that takes an array from the mesh that was made."""
    made: Any = cached_property(lambda squares: getattr(squares._made, name))
    made.__set_name__(Squares, name)
    return made


for _name in ("positions", "triangles", *_OF_POINTS):
    setattr(Squares, _name, _delegated(_name))


def _stroked(mesh: Mesh, world: Array, screen: Viewport, points: Points | None = None) -> Mesh:
    """Returns what `stroked` does, without a cache. points: the points if the mesh consists of points alone."""
    assert mesh.strokes is not None
    names = [name for name in _OF_POINTS if points and points.array(name) is not None]
    given = {name: getattr(mesh, name) for name in ("normals", "uvs", "colours") if getattr(mesh, name) is not None}
    if points:
        given = {name: points.array(name) for name in names}
    widths = {"positions": 3, "normals": 3, **{name: values.shape[1] for name, values in given.items()}}
    # The memory of rows that are never written is not taken.
    arrays = {name: np.empty((4 * len(mesh.strokes), width), dtype=np.float32) for name, width in widths.items()}
    # The plane of all squares is parallel to the picture.
    written: dict[str, Any] = {"normals": screen.view.axes[2]}
    count = 0
    for made, vertices in _batches(mesh, world, screen):
        rows = slice(count, count + len(made.vertices))
        count = rows.stop
        written["positions"] = made.vertices - screen.view.eye
        for name, values in given.items():
            at_ends = values[vertices]
            if name == "normals" and not points:
                normals = made.interpolated(at_ends @ _cofactors(world[:3, :3]))
                written[name] = _turned(normals, _toward_viewer(screen.view, made.vertices))
            else:
                written[name] = made.interpolated(at_ends)
        for name, array in arrays.items():
            array[rows] = written[name]
    if not count:
        nothing = {name: np.zeros((1, width), dtype=np.float32) for name, width in widths.items()}
        return Mesh(triangles=np.zeros((1, 3), dtype=np.uint32), origin=screen.view.eye, **nothing)
    first = 4 * np.arange(count // 4, dtype=np.uint32)[:, None]
    attributes: dict[str, Any] = {name: _owned(array[:count]) for name, array in arrays.items()}
    return Mesh(triangles=_owned((first + CORNERS).reshape(-1, 3)), origin=screen.view.eye, **attributes)


def _batches(mesh: Mesh, world: Array, screen: Viewport) -> Iterator[tuple[Strips, Indices]]:
    """Yields the corners of strokes that may be visible, and the vertices (V,) of the mesh to which their ends refer."""
    assert mesh.strokes is not None
    of_points = is_points(mesh)
    for start in range(0, len(mesh.strokes), BATCH):
        strokes = mesh.strokes[start : start + BATCH].astype(np.int64)
        vertices = strokes[:, 0] if of_points else strokes.reshape(-1)
        positions = (mesh.positions[vertices] + mesh.origin) @ world[:3, :3].T + world[:3, 3]
        outside = _outside(screen, positions)
        if of_points:
            seen = np.flatnonzero(outside == 0)
            yield _squares(screen, positions, np.stack([seen, seen], axis=1)), vertices
            continue
        ends = np.arange(len(vertices)).reshape(-1, 2)
        # A point of the mesh is a line from one vertex to itself.
        ends[strokes[:, 0] == strokes[:, 1], 1] -= 1
        yield strips(screen, positions, ends[(outside[0::2] & outside[1::2]) == 0]), vertices


def _owned(array: NDArray[Any]) -> NDArray[Any]:
    """Returns the array, which is read-only from now on, so that Mesh need not copy it."""
    owner: Any = array
    while isinstance(owner, np.ndarray):
        owner.flags.writeable = False
        owner = owner.base
    return array


def _cofactors(linear: Array) -> Array:
    """Returns the matrix (3, 3) whose product with a row, n @ matrix, is a normal of the space to which `linear` leads.

    Its side and its length mean nothing. It is the transposed cofactor matrix, which also exists where `linear` flattens space.
    """
    a, b, c = (linear / (np.abs(linear).max() or 1.0)).T
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])


def _outside(screen: Viewport, positions: Array) -> NDArray[np.uint8]:
    """Returns the planes round the picture outside of which each of V vertices lies, as the bits of a number (V,).

    A line whose two ends lie outside of the same plane is not seen.

    positions: (V, 3), in world space.
    """
    view = screen.view
    x, y, z = (np.ascontiguousarray(column) for column in ((positions - view.eye) @ view.axes.T).T)
    depth = -z
    scale = depth if view.perspective else np.ones_like(depth)
    # A square reaches half its side beyond its centre. The samples of a pixel, and the shifted pictures of supersampling, lie
    # within one pixel.
    reach = max(screen.point_size, screen.line_width) / 2 + 1
    planes = [depth < view.near, depth > view.far]
    for along, half, side, centre in zip((x, y), (view.half_width, view.half_height), screen.size, view.centre, strict=True):
        room = 1 + 2 * reach / side
        planes += [along > half * (room - centre) * scale, along < -half * (room + centre) * scale]
    bits = np.zeros(len(positions), dtype=np.uint8)
    for number, outside in enumerate(planes):
        bits |= outside.astype(np.uint8) << np.uint8(number)
    return bits


def _toward_viewer(view: View, points: Array) -> Array:
    """Returns the unit directions (N, 3) from points (N, 3) to the viewer, in world space."""
    if not view.perspective:
        return np.broadcast_to(view.axes[2], points.shape)
    return normalised(view.eye - points)[0]


def _turned(normals: Array, facing: Array) -> Array:
    """Returns unit normals (N, 3) on the viewer's side, from normals (N, 3) of any length; `facing` in place of zero normals.

    facing: (N, 3), the directions to the viewer.
    """
    unit, length = normalised(normals)
    side = np.einsum("ij,ij->i", unit, facing)[:, None]
    return np.where(length[:, None] > 0, np.where(side < 0, -unit, unit), facing)


@dataclass(frozen=True, eq=False)
class Strips:
    """The four corners of each of N strokes that may be visible, counter-clockwise as the viewer sees them.

    vertices: (4N, 3), the corners in world space.
    ends: (N, 2), the vertices that each stroke joins.
    shares: (4N, 1), the position of each corner on its line, from 0 at the first end to 1 at the second; None for points.
    """

    vertices: Array
    ends: Indices
    shares: Array | None

    @property
    def triangles(self) -> Indices:
        """The triangles (2N, 3), two for each stroke."""
        first = 4 * np.arange(len(self.ends))[:, None]
        return (first + CORNERS).reshape(-1, 3)

    def interpolated(self, values: Any) -> Array:
        """Returns the values (4N, C) of the corners, from values (V, C) of the vertices."""
        if self.shares is None:
            return np.repeat(np.asarray(values)[self.ends[:, 0]], 4, axis=0)
        values = np.asarray(values, dtype=np.float64)
        start, stop = (np.repeat(values[self.ends[:, i]], 4, axis=0) for i in (0, 1))
        result: Array = start + self.shares * (stop - start)
        return result


def strips(screen: Viewport, positions: Array, ends: Indices) -> Strips:
    """Returns the corners of strokes: points become squares, and lines become strips.

    Strokes behind the near plane are left out.

    screen: the picture in which they have their sizes.
    positions: (V, 3), the vertices in world space.
    ends: (N, 2), the vertices that each stroke joins; twice the same vertex is a point.
    """
    view = screen.view
    a, b, shares, visible = _in_front(view, positions[ends[:, 0]], positions[ends[:, 1]])
    a, b, shares, ends = a[visible], b[visible], shares[visible], ends[visible]
    # A point is treated as a horizontal line whose two ends coincide. Its square extends by half its side along that line and
    # across it.
    is_point = (ends[:, 0] == ends[:, 1])[:, None]
    along = np.where(is_point, screen.point_size / 2, 0.0)
    across = np.where(is_point, screen.point_size / 2, screen.line_width / 2)
    pixel_a, pixel_b = (_pixel(screen, p) for p in (a, b))
    difference = (pixel_b - pixel_a) * screen.size
    length = np.linalg.norm(difference, axis=1, keepdims=True)
    # A line whose ends cover the same point of the picture has no direction there. Its strip has no area.
    direction = np.divide(difference, length, out=np.zeros_like(difference), where=length > 0)
    direction = np.where(is_point, np.array([1.0, 0.0]), direction)
    sideways = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    corners, sources = [], []
    for end, sign_along, sign_across in ((0, -1, -1), (1, 1, -1), (1, 1, 1), (0, -1, 1)):
        p, pixel = ((a, pixel_a), (b, pixel_b))[end]
        offset = sign_along * along * direction + sign_across * across * sideways
        if screen.on_grid:
            offset = offset + _to_grid(screen, pixel, pixel_a, pixel_b, offset)
        corners.append(p + (offset * _pixel_size(screen, p)) @ view.axes[:2])
        sources.append(shares[:, end])
    return Strips(np.stack(corners, axis=1).reshape(-1, 3), ends, np.stack(sources, axis=1).reshape(-1, 1))


def _squares(screen: Viewport, positions: Array, ends: Indices) -> Strips:
    """Returns what `strips` returns for points, in a third of the time."""
    view = screen.view
    points = positions[ends[:, 0]]
    visible = view.depth(points) >= view.near
    if not visible.all():
        points, ends = points[visible], ends[visible]
    low, high = _extent(screen, points)
    size = _pixel_size(screen, points)
    low, high = low * size, high * size
    corners = np.empty((len(points), 4, 3))
    for number, (x, y) in enumerate(((low, low), (high, low), (high, high), (low, high))):
        corners[:, number] = points + x[:, :1] * view.axes[0] + y[:, 1:] * view.axes[1]
    return Strips(corners.reshape(-1, 3), ends, None)


def _extent(screen: Viewport, points: Array) -> tuple[Array, Array]:
    """Returns two corners of squares relative to their points (N, 3), the lower left and the upper right one [pixels].

    Each is (N, 2), or (1, 2) where all squares are alike.
    """
    half = np.full((1, 2), screen.point_size / 2)
    if not screen.on_grid:
        return -half, half
    centre = (_pixel(screen, points) + screen.corner) * screen.size
    return _edge(centre - half) - centre, _edge(centre + half) - centre


def _centred_on_grid(screen: Viewport, points: Array) -> Array:
    """Returns the centres (N, 3) of the squares of points (N, 3), which `on_grid` moves by half a pixel at most."""
    if not screen.on_grid:
        return points
    low, high = _extent(screen, points)
    step = (low + high) / 2 * _pixel_size(screen, points)
    moved: Array = points + step @ screen.view.axes[:2]
    return moved


def _edge(corner: Array) -> Array:
    """Returns the corners of pixels (N, 2) between which a rectangle covers the same centres as between the corners given.

    The pixel with the number k is covered if its centre k + 1/2 lies at the left edge or to the right of it. y points up here,
    but down in that rule.

    corner: (N, 2), from the picture's bottom left [pixels].
    """
    return np.stack([np.ceil(corner[:, 0] - 0.5), np.floor(corner[:, 1] + 0.5)], axis=1)


def _to_grid(screen: Viewport, pixel: Array, pixel_a: Array, pixel_b: Array, offset: Array) -> Array:
    """Returns the steps (N, 2) that move corners to the edge of a pixel, without a change of the centres that are covered.

    The step is 0 for lines that are not parallel to a side of the picture [pixels].

    pixel: (N, 2), the end that each corner belongs to, as `_pixel` returns it.
    pixel_a, pixel_b: (N, 2), both ends.
    offset: (N, 2), the place of the corner relative to its end [pixels].
    """
    size = np.array(screen.size)
    extent = np.abs(pixel_b - pixel_a) * size
    parallel = extent < STRAIGHT
    # Both ends of a line count as equally far along the axis across it, so that its strip becomes a rectangle.
    centre = np.where(parallel, (pixel_a + pixel_b) / 2, pixel)
    step = _edge((centre + screen.corner) * size + offset) - (pixel + screen.corner) * size - offset
    return np.where(parallel.any(axis=1, keepdims=True), step, 0.0)


def _in_front(view: View, a: Array, b: Array) -> tuple[Array, Array, Array, Flags]:
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
    """Returns the positions (N, 2) of points (N, 3) in the picture, as shares of its width and height; x to the right, y up.

    0 is where the camera's axis meets the picture.
    """
    view = screen.view
    flat = (points - view.eye) @ view.axes[:2].T
    result: Array = flat / (_pixel_size(screen, points) * screen.size)
    return result
