"""Raster: the coverage of pixels by triangles, and the depth test (OpenGL 4.6 core, 14.6.1 and 17.3.4).

Corners are snapped to 1/256 of a pixel (GL_SUBPIXEL_BITS is 8 on all drivers that were tried). A triangle covers a pixel if
the pixel's centre lies inside it, or on one of its left or top edges. Coordinates are integers in units of 1/256 pixel; float64
holds them and their products exactly for pictures of up to 2^16 pixels a side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.joined_draw import Corners
from glshade.reference import clip
from glshade.reference.inputs import Inputs
from glshade.reference.interpolate import weights

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Box = tuple[int, int, int, int]

# The number of snapping steps per pixel.
SUBPIXELS = 256
HALF = SUBPIXELS // 2
# A driver moves corners, and the edges between them, by up to one step of its own grid. If a point is nearer to an edge than
# this step and two steps of the reference's grid, a driver may cover the point or not. One of the two is for the reference's
# own snapping and for the driver's rounding of corners to float32, and the other is a reserve [1/256 pixel].
RESERVE = 2.0
# The distance from an edge for a driver with the same grid as the reference's [1/256 pixel].
MARGIN = 1.0 + RESERVE
# The largest relative error of one float32 rounding.
U = 2.0**-24
# The error of a vertex's window position [roundings].
WINDOW = 2.0
# The numbers of triangles and of candidate pixels that are processed at once. They make arrays of about 10 MB, which use the
# processor's caches better than larger arrays.
TRIANGLES = 1 << 17
PIXELS = 1 << 18


@dataclass(frozen=True, eq=False)
class Fragments:
    """N pairs of a triangle and a pixel, as arrays (N,).

    draw: the index into Inputs.draws.
    triangle: the row of the draw's triangles.
    pixel: the number of the pixel, row * width + column, row 0 at the top.
    covered: whether the triangle covers the pixel's centre by the fill rule.
    partial: whether an edge is so near to one of the pixel's samples that a driver may leave this sample out, or cover it
        although the reference does not.
    front: whether the front of the triangle is seen.
    depth: the depth at the pixel's centre, 1 near and 0 far.
    """

    draw: NDArray[np.int32]
    triangle: NDArray[np.int32]
    pixel: NDArray[np.int64]
    covered: Flags
    partial: Flags
    front: Flags
    depth: Array

    def __len__(self) -> int:
        return len(self.pixel)

    def take(self, which: Any) -> Fragments:
        """Returns the fragments that an index array or a mask selects."""
        return Fragments(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    @classmethod
    def joined(cls, parts: Iterable[Fragments]) -> Fragments:
        """Returns the fragments of all parts, in the order of the parts."""
        parts = list(parts) or [cls.none()]
        return cls(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)})

    @classmethod
    def none(cls) -> Fragments:
        """Returns an empty list of fragments."""
        return cls(
            draw=np.empty(0, dtype=np.int32),
            triangle=np.empty(0, dtype=np.int32),
            pixel=np.empty(0, dtype=np.int64),
            covered=np.empty(0, dtype=np.bool_),
            partial=np.empty(0, dtype=np.bool_),
            front=np.empty(0, dtype=np.bool_),
            depth=np.empty(0, dtype=np.float64),
        )


def rasterise(inputs: Inputs, margin: float = 0.0) -> Iterator[Fragments]:
    """Yields all fragments, including hidden ones, in pieces of about 100,000.

    The pieces are in the order of drawing. A piece may hold fragments of several draws: then all of these are blended, or none.

    inputs: the scene with its uploaded values.
    margin: 0 for the fragments that cover a pixel's centre; Freedom.margin for every fragment that a driver might draw, at the
        centre or at any other place where the pixel may have samples (Inputs.extent) [1/256 pixel].
    """
    for first, members in _groups(inputs.draws):
        yield from _rasterise(members[0] if len(members) == 1 else Corners.whole(members), first, inputs, margin)


def _groups(draws: Sequence[Draw]) -> Iterator[tuple[int, Sequence[Draw]]]:
    """Yields (index of the first draw, draws that follow one another), with at most TRIANGLES triangles or a single draw."""
    start, size = 0, 0
    for number, draw in enumerate(draws):
        more = max(len(draw.triangles), len(draw.instance.mesh.positions))
        changes = (draw.alpha_mode == "blend") != (draws[start].alpha_mode == "blend")
        if number > start and (changes or size + more > TRIANGLES):
            yield start, draws[start:number]
            start, size = number, 0
        size += more
    if draws:
        yield start, draws[start:]


def resolve(inputs: Inputs, parts: Iterable[Fragments], opaque: Callable[[Fragments], Flags]) -> tuple[Fragments, Fragments]:
    """Applies the depth test to covered fragments: (nearest opaque fragments, blended fragments in front of them).

    There is at most one nearest fragment per pixel, and they are ordered by pixel. Depths are compared as float32. Between
    equal depths, the fragment that is drawn first wins. The blended fragments are ordered by pixel and then in drawing order.
    inputs: the scene with its uploaded values.
    parts: the fragments, as `rasterise` yields them.
    opaque: a function that returns whether each given fragment of a cut-out is kept.
    """
    width, height = inputs.size
    depth = np.zeros(width * height, dtype=np.float32)
    seen = {f.name: np.zeros(width * height, dtype=getattr(Fragments.none(), f.name).dtype) for f in fields(Fragments)}
    layers = []
    modes = np.array([draw.alpha_mode for draw in inputs.draws])
    for part in parts:
        mode = modes[part.draw]
        z, before = part.depth.astype(np.float32), depth[part.pixel]
        # The fragments of a piece are not ordered by draw and triangle.
        draw, triangle = seen["draw"][part.pixel], seen["triangle"][part.pixel]
        earlier = (part.draw < draw) | ((part.draw == draw) & (part.triangle < triangle))
        near = part.covered & (z > 0) & ((z > before) | ((z == before) & earlier & (mode != "blend")))
        blended = part.take(near & (mode == "blend"))
        if len(blended):
            layers.append(blended)
        part = part.take(near & (mode != "blend"))
        masked = np.flatnonzero(modes[part.draw] == "mask")
        if len(masked):
            kept = np.ones(len(part), dtype=np.bool_)
            kept[masked] = opaque(part.take(masked))
            part = part.take(kept)
        # The depth test keeps the fragment of the largest depth at a pixel, and among equal depths the one that is drawn first.
        # After sorting, it is the first fragment of the pixel.
        z = part.depth.astype(np.float32)
        order = np.lexsort((part.triangle, part.draw, -z, part.pixel))
        first = np.ones(len(order), dtype=np.bool_)
        first[1:] = part.pixel[order[1:]] != part.pixel[order[:-1]]
        part = part.take(order[first])
        depth[part.pixel] = z[order[first]]
        for name, values in seen.items():
            values[part.pixel] = getattr(part, name)
    nearest = Fragments(**seen).take(depth > 0)
    over = Fragments.joined(layers)
    return nearest, over.take(np.lexsort((over.triangle, over.draw, over.pixel)))


def _rasterise(draw: Draw | Corners, first: int, inputs: Inputs, margin: float) -> Iterator[Fragments]:
    """Yields the fragments of one draw, or of draws that follow one another.

    draw: the instance that is drawn, or all corners of several.
    first: the index into Inputs.draws of the first of them.
    inputs: the scene with its uploaded values.
    margin: as for rasterise [1/256 pixel].
    """
    size = inputs.size
    members = draw.members if isinstance(draw, Corners) else (draw,)
    counts = np.array([len(member.triangles) for member in members])
    owner, base = np.repeat(np.arange(len(members)), counts), np.cumsum(counts) - counts
    mirrored, both = (
        np.array([member.instance.mirrored for member in members]),
        np.array([member.back_faces for member in members]),
    )
    code = clip.outside(draw.clip)
    # Triangles must be clipped if they reach beyond the near or far plane, or beyond the guard band at the sides.
    cut = (clip.outside(draw.clip, clip.GUARDED) != 0) | (code & clip.DEPTH != 0)
    if margin:
        # A driver may also clip triangles that reach just beyond the sides. That matters where it draws the new edge displaced.
        cut |= (code != 0) & (_displacement(draw.clip_terms, draw.clip[:, None], size) > 0)
    snapped = _snapped(np.where(cut[:, None], (0.0, 0.0, 0.0, 1.0), draw.clip), size)
    for start in range(0, len(draw.triangles), TRIANGLES):
        triangles = draw.triangles[start : start + TRIANGLES]
        a, b, c = triangles.T
        possible = np.flatnonzero(code[a] & code[b] & code[c] == 0)
        a, b, c = triangles[possible].T
        crossing = cut[a] | cut[b] | cut[c]
        whole = possible[~crossing]
        pieces = [(snapped[triangles[whole]], draw.clip[triangles[whole]] if margin else None, whole)]
        if crossing.any():
            broken = possible[crossing]
            polygons, corners = clip.cut(draw.clip[triangles[broken]])
            left = corners >= 3
            pieces.append((_snapped(polygons[left], size), polygons[left] if margin else None, broken[left]))
        for polygons, exact, which in pieces:
            displaced = np.zeros(len(which))
            if exact is not None:
                displaced = _displacement(draw.clip_terms[triangles[which]].max(axis=1), exact, size)
            member = owner[which + start]
            faces = mirrored[member], both[member]
            for index, x, y, covered, partial, front in _cover(polygons, inputs, faces, margin, displaced):
                triangle = which[index] + start
                depth = weights(draw, triangle, x + 0.5, y + 0.5, size, derivatives=False).depth
                yield Fragments(
                    draw=(member[index] + first).astype(np.int32),
                    triangle=(triangle - base[member[index]]).astype(np.int32),
                    pixel=(y * size[0] + x).astype(np.int64),
                    covered=covered,
                    partial=partial,
                    front=front,
                    depth=depth,
                )


def _snapped(points: Array, size: tuple[int, int]) -> Array:
    """Returns the positions (..., 2) of points in the picture, rounded to integers [1/256 pixel].

    points: points (..., 4) in clip space with w > 0, of any leading shape, which the result keeps.
    size: width and height of the whole picture [pixels].
    """
    scale = 0.5 * SUBPIXELS * np.array(size)
    result: Array = np.rint((points[..., :2] / points[..., 3:] + 1) * scale)
    return result


def _displacement(terms: Array, corners: Array, size: tuple[int, int]) -> Array:
    """How far (P,) a driver may draw the corners of polygons beside their exact places [1/256 pixel], less one step.

    MARGIN allows for the one step. Only the corners of a polygon that reaches far beyond the view are displaced by more: they
    are computed from coordinates that are much larger than w.
    terms: the sums (P, 4) of the absolute values of the terms that make up the coordinates.
    corners: the corners (P, E, 4) in clip space.
    size: width and height of the whole picture [pixels].
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        w = np.abs(corners[..., 3:])
        screen = np.abs(corners[..., :2]) / w
        moved = (terms[:, None, :2] + screen * terms[:, None, 3:]) / w * (0.5 * SUBPIXELS * np.array(size))
    result: Array = np.maximum(WINDOW * U * moved.max(axis=(1, 2)) - 1, 0)
    return result


def _cover(
    polygons: Array, inputs: Inputs, faces: tuple[Flags, Flags], margin: float, displaced: Array
) -> Iterator[tuple[Indices, Indices, Indices, Flags, Flags, Flags]]:
    """Yields (polygon, x, y, covered, partial, front) of the pixels in convex polygons, in batches, ordered by polygon.

    polygons: the corners (P, E, 2) of P polygons with E corners each [1/256 pixel].
    inputs: the scene with its uploaded values.
    faces: whether (P,) each polygon's instance is mirrored, and whether (P,) its back faces are drawn.
    margin: as for rasterise [1/256 pixel].
    displaced: how far (P,) a driver may draw each polygon's corners beside their places, beyond the margin [1/256 pixel].
    """
    mirrored, back_faces = faces
    margins = margin + displaced
    extent = inputs.extent * SUBPIXELS if margin else 0.0
    following = np.roll(polygons, -1, axis=1)
    across, down = following[..., 0] - polygons[..., 0], following[..., 1] - polygons[..., 1]
    # Twice the area, from vectors relative to the first corner, which avoids the subtraction of large numbers.
    rays = polygons[:, 1:] - polygons[:, :1]
    area = (rays[:, :-1, 0] * rays[:, 1:, 1] - rays[:, :-1, 1] * rays[:, 1:, 0]).sum(axis=1)
    length = np.hypot(across, down)
    # y points down in the picture, so polygons that are counter-clockwise in space have a negative area.
    front = (area < 0) != mirrored
    drawn = (area != 0) & (front | back_faces)
    if margin:
        # A triangle lower than two snapping steps may turn over, or gain an area, when a corner moves by one step.
        thin = np.abs(area) <= (2 * (margin - RESERVE) + displaced) * length.max(axis=1)
        front |= thin & ~back_faces
        drawn |= thin
    reach = (margins + extent)[:, None]
    low = np.ceil((polygons.min(axis=1) - reach - HALF) / SUBPIXELS)
    high = np.floor((polygons.max(axis=1) + reach - HALF) / SUBPIXELS)
    corner, size = np.array(inputs.window[:2]), np.array(inputs.window[2:])
    low, high = np.maximum(low, corner), np.minimum(high, corner + size - 1)
    kept = np.flatnonzero(drawn & (low <= high).all(axis=1))
    low, high, front = low[kept], high[kept], front[kept]
    turn = np.where(area[kept] < 0, -1.0, 1.0)[:, None]
    # A centre is inside a polygon where inward . (centre - corner) > 0 for every edge.
    edges = _Edges(polygons[kept], -down[kept] * turn, across[kept] * turn, length[kept], margins[kept], extent)
    rows = (high[:, 1] - low[:, 1] + 1).astype(np.intp)
    for row_batch in _batches(rows):
        index, step = _expanded(rows[row_batch], row_batch.start)
        y = low[index, 1] + step
        left, right = edges.span(index, y * SUBPIXELS + HALF)
        left = np.maximum(np.ceil((left - HALF) / SUBPIXELS - 1e-6), low[index, 0])
        right = np.minimum(np.floor((right - HALF) / SUBPIXELS + 1e-6), high[index, 0])
        columns = np.maximum(right - left + 1, 0).astype(np.intp)
        for pixel_batch in _batches(columns):
            row, step = _expanded(columns[pixel_batch], pixel_batch.start)
            polygon = index[row]
            px, py = left[row] + step, y[row]
            covered, partial = edges.inside(polygon, px * SUBPIXELS + HALF, py * SUBPIXELS + HALF)
            hit = covered | partial if margin else covered
            polygon = polygon[hit]
            yield (
                kept[polygon],
                px[hit].astype(np.intp),
                py[hit].astype(np.intp),
                covered[hit],
                partial[hit],
                front[polygon],
            )


class _Edges:
    """The edges of P polygons with E edges each.

    corner_x: x (P, E) of the edges' first corners [1/256 pixel].
    corner_y: y (P, E) of the edges' first corners [1/256 pixel].
    x: x (P, E) of the inward normals, which are as long as their edges.
    y: y (P, E) of the inward normals.
    slack: the margin and the reach (P, E) of a pixel's square toward the edge, both times the edge's length.
    real: whether (P, E) the edge has a length; repeated corners make edges without one.
    owns: whether (P, E) points on the edge belong to the polygon.
    """

    def __init__(self, corners: Array, x: Array, y: Array, length: Array, margins: Array, extent: float) -> None:
        """corners: (P, E, 2) [1/256 pixel]. x, y: the inward normals (P, E). length: the edges' lengths (P, E).

        margins: (P,) [1/256 pixel]. extent: half the side of the square in which a pixel has its samples [1/256 pixel].
        """
        self.corner_x, self.corner_y = corners[..., 0], corners[..., 1]
        self.x, self.y = x, y
        self.slack = margins[:, None] * length + extent * (np.abs(x) + np.abs(y))
        self.real = length > 0
        # The fill rule: the inward normal of a left edge points right, and that of a top edge points straight down.
        self.owns = ~self.real | (x > 0) | ((x == 0) & (y > 0))

    def span(self, polygon: Indices, y: Array) -> tuple[Array, Array]:
        """Returns the range of x, (left, right), each (N,), in which the row y (N,) is inside its polygon (N,) or within the
        margin.
        """
        x = self.x[polygon]
        rise = self.y[polygon] * (y[:, None] - self.corner_y[polygon]) + self.slack[polygon]
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = self.corner_x[polygon] - rise / x
        left = np.where(x > 0, bound, -np.inf).max(axis=1)
        right = np.where(x < 0, bound, np.inf).min(axis=1)
        right[((x == 0) & (rise < 0)).any(axis=1)] = -np.inf
        return left, right

    def inside(self, polygon: Indices, x: Array, y: Array) -> tuple[Flags, Flags]:
        """Returns (covered, partial), each (N,): the flags of each point x, y (N,) [1/256 pixel] in its polygon (N,)."""
        distance = self.x[polygon] * (x[:, None] - self.corner_x[polygon])
        distance += self.y[polygon] * (y[:, None] - self.corner_y[polygon])
        covered = np.all((distance > 0) | ((distance == 0) & self.owns[polygon]), axis=1)
        slack = self.slack[polygon]
        near = np.all(distance >= -slack, axis=1)
        # A polygon whose corners all coincide has no edges with a length, and no inside.
        real = self.real[polygon]
        full = np.all((distance > slack) | ~real, axis=1) & real.any(axis=1)
        return covered, np.logical_and(near, ~full)


def _batches(counts: Indices) -> Iterator[slice]:
    """Yields slices of `counts` (N,). The elements of each add up to at most PIXELS, unless it has a single element."""
    total = np.cumsum(counts)
    if len(total) == 0 or total[-1] == 0:
        return
    start = 0
    while start < len(counts):
        base = total[start - 1] if start else 0
        end = max(int(np.searchsorted(total, base + PIXELS, side="right")), start + 1)
        yield slice(start, end)
        start = end


def _expanded(counts: Indices, start: int) -> tuple[Indices, Indices]:
    """Returns two arrays: start + i, repeated counts[i] times for every i; and the number of each repetition, from 0 for every
    i.
    """
    index = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts, counts)
    return index + start, step
