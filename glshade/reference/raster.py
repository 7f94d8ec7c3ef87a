"""Raster: which triangles cover which pixels, and which of them are seen. OpenGL 4.6 core, 14.6.1 and 17.3.4.

Corners are snapped to 1/256 of a pixel (GL_SUBPIXEL_BITS of every driver at hand), and a pixel belongs to a triangle when its
centre lies inside, or on an edge that is the triangle's left or top one. Every number here is a whole number of 1/256 pixels,
or a product of two, kept exactly in float64 up to pictures of 2^16 pixels a side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.reference import clip
from glshade.reference.inputs import Inputs
from glshade.reference.interpolate import weights

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Box = tuple[int, int, int, int]

SUBPIXELS = 256
HALF = SUBPIXELS // 2
# Nearer to an edge than this [1/256 pixel] a driver may decide either way: its corners are float32 before they are snapped,
# which moves them by a step, and the edges between them by no more; the rest is to spare.
MARGIN = 3.0
# Triangles, and candidate pixels, looked at in one go: arrays of some 10 MB stay near the caches.
TRIANGLES = 1 << 17
PIXELS = 1 << 18


@dataclass(frozen=True, eq=False)
class Fragments:
    """Pixels of triangles, as flat arrays (N,).

    draw: index into Inputs.draws. triangle: row of the draw's triangles. pixel: row x width + column, row 0 at the top.
    covered: whether the fill rule gives the pixel to the triangle. partial: whether its centre is so near an edge that a
    driver may decide otherwise. front: whether the front is seen. depth: at the pixel's centre, 1 near and 0 far.
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
        """Those that an index array or a mask selects."""
        return Fragments(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    @classmethod
    def joined(cls, parts: Iterable[Fragments]) -> Fragments:
        """All of them, in the order given."""
        parts = list(parts) or [cls.none()]
        return cls(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)})

    @classmethod
    def none(cls) -> Fragments:
        """Not one."""
        types: dict[str, Any] = {
            **{"pixel": np.int64, "depth": np.float64},
            **dict.fromkeys(("covered", "partial", "front"), np.bool_),
        }
        return cls(**{f.name: np.empty(0, dtype=types.get(f.name, np.int32)) for f in fields(cls)})


def rasterise(inputs: Inputs, margin: float = 0.0) -> Iterator[Fragments]:
    """All fragments in the order of drawing, hidden ones too, in pieces of some 100,000.

    margin [1/256 pixel]: 0 for the covered ones alone; MARGIN for every fragment that a driver might draw.
    """
    for number, draw in enumerate(inputs.draws):
        yield from _rasterise(draw, number, inputs.size, inputs.window, margin)


def resolve(inputs: Inputs, parts: Iterable[Fragments], opaque: Callable[[Fragments], Flags]) -> tuple[Fragments, Fragments]:
    """(nearest, layers) of the covered fragments: what is seen at each pixel, and what is blended over it.

    nearest: at most one a pixel, by pixel; depths are compared as float32, and of equal ones the first drawn wins. layers: in
    front of the nearest, by pixel and in the order of drawing. opaque: which fragments of a cut-out are there.
    """
    width, height = inputs.size
    depth = np.zeros(width * height, dtype=np.float32)
    seen = {f.name: np.zeros(width * height, dtype=getattr(Fragments.none(), f.name).dtype) for f in fields(Fragments)}
    layers = []
    modes = np.array([draw.alpha_mode for draw in inputs.draws])
    for part in parts:
        mode = modes[part.draw]
        z, before = part.depth.astype(np.float32), depth[part.pixel]
        # Pieces come draw by draw, but within one not triangle by triangle.
        earlier = (part.draw == seen["draw"][part.pixel]) & (part.triangle < seen["triangle"][part.pixel])
        near = part.covered & (z > 0) & ((z > before) | ((z == before) & earlier & (mode != "blend")))
        blended = part.take(near & (mode == "blend"))
        if len(blended):
            layers.append(blended)
        part = part.take(near & (mode != "blend"))
        masked = np.flatnonzero(modes[part.draw] == "mask")
        if len(masked):
            there = np.ones(len(part), dtype=np.bool_)
            there[masked] = opaque(part.take(masked))
            part = part.take(there)
        # The least of (pixel, farness, place in the order of drawing) is what the depth test leaves at a pixel.
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


def _rasterise(draw: Draw, number: int, size: tuple[int, int], window: Box, margin: float) -> Iterator[Fragments]:
    code = clip.outside(draw.clip)
    # What sticks out at the sides may stay whole; what reaches past near or far must be cut.
    cut = (clip.outside(draw.clip, clip.GUARDED) != 0) | (code & 0b110000 != 0)
    snapped = _snapped(np.where(cut[:, None], (0.0, 0.0, 0.0, 1.0), draw.clip), size)
    for start in range(0, len(draw.triangles), TRIANGLES):
        triangles = draw.triangles[start : start + TRIANGLES]
        a, b, c = triangles.T
        possible = np.flatnonzero(code[a] & code[b] & code[c] == 0)
        a, b, c = triangles[possible].T
        crossing = cut[a] | cut[b] | cut[c]
        whole = possible[~crossing]
        pieces = [(snapped[triangles[whole]], whole)]
        if crossing.any():
            broken = possible[crossing]
            polygons, corners = clip.cut(draw.clip[triangles[broken]])
            left = corners >= 3
            pieces.append((_snapped(polygons[left], size), broken[left]))
        for polygons, which in pieces:
            for index, x, y, covered, partial, front in _cover(polygons, window, draw, margin):
                triangle = which[index] + start
                depth = weights(draw, triangle, x + 0.5, y + 0.5, size, derivatives=False).depth
                yield Fragments(
                    draw=np.full(len(index), number, dtype=np.int32),
                    triangle=triangle.astype(np.int32),
                    pixel=(y * size[0] + x).astype(np.int64),
                    covered=covered,
                    partial=partial,
                    front=front,
                    depth=depth,
                )


def _snapped(points: Array, size: tuple[int, int]) -> Array:
    """(..., 2): where the clip-space points (..., 4) with w > 0 come to lie in the picture [1/256 pixel], whole numbers."""
    scale = 0.5 * SUBPIXELS * np.array(size)
    result: Array = np.rint((points[..., :2] / points[..., 3:] + 1) * scale)
    return result


def _cover(
    polygons: Array, window: Box, draw: Draw, margin: float
) -> Iterator[tuple[Indices, Indices, Indices, Flags, Flags, Flags]]:
    """(polygon, x, y, covered, partial, front) of convex polygons (P, E, 2) [1/256 pixel], by polygon.

    window: x, y, width, height [pixels] that are looked at.
    """
    following = np.roll(polygons, -1, axis=1)
    across, down = following[..., 0] - polygons[..., 0], following[..., 1] - polygons[..., 1]
    # Twice the area, from the first corner, so that no large numbers are subtracted.
    rays = polygons[:, 1:] - polygons[:, :1]
    area = (rays[:, :-1, 0] * rays[:, 1:, 1] - rays[:, :-1, 1] * rays[:, 1:, 0]).sum(axis=1)
    length = np.hypot(across, down)
    # y points down, so what is counter-clockwise in space has a negative area here.
    front = (area < 0) != draw.instance.mirrored
    drawn = area != 0
    if not draw.instance.back_faces:
        drawn &= front
    if margin:
        # Lower than two steps, a triangle may turn over, or get an area, when a corner moves by one.
        thin = np.abs(area) <= 2 * length.max(axis=1)
        front |= thin & (not draw.instance.back_faces)
        drawn |= thin
    low = np.ceil((polygons.min(axis=1) - margin - HALF) / SUBPIXELS)
    high = np.floor((polygons.max(axis=1) + margin - HALF) / SUBPIXELS)
    corner, size = np.array(window[:2]), np.array(window[2:])
    low, high = np.maximum(low, corner), np.minimum(high, corner + size - 1)
    kept = np.flatnonzero(drawn & (low <= high).all(axis=1))
    low, high, front = low[kept], high[kept], front[kept]
    turn = np.where(area[kept] < 0, -1.0, 1.0)[:, None]
    # Inside is where inward . (centre - corner) > 0 for every edge.
    edges = _Edges(polygons[kept], -down[kept] * turn, across[kept] * turn, length[kept], margin)
    rows = (high[:, 1] - low[:, 1] + 1).astype(np.intp)
    for several in _batches(rows):
        index, step = _expanded(rows[several], several.start)
        y = low[index, 1] + step
        left, right = edges.span(index, y * SUBPIXELS + HALF)
        left = np.maximum(np.ceil((left - HALF) / SUBPIXELS - 1e-6), low[index, 0])
        right = np.minimum(np.floor((right - HALF) / SUBPIXELS + 1e-6), high[index, 0])
        columns = np.maximum(right - left + 1, 0).astype(np.intp)
        for some in _batches(columns):
            row, step = _expanded(columns[some], some.start)
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
    """Edges of polygons: corners (P, E, 2), inward normals x, y (P, E) and their lengths (P, E), 0 where corners coincide."""

    def __init__(self, corners: Array, x: Array, y: Array, length: Array, margin: float) -> None:
        self.corner_x, self.corner_y = corners[..., 0], corners[..., 1]
        self.x, self.y = x, y
        self.slack = margin * length
        self.real = length > 0
        # On an edge: left edges look right, and of the level ones the top one looks down.
        self.owns = ~self.real | (x > 0) | ((x == 0) & (y > 0))

    def span(self, polygon: Indices, y: Array) -> tuple[Array, Array]:
        """From where to where the row y (N,) [1/256 pixel] of the polygons (N,) lies inside, or within the margin."""
        x = self.x[polygon]
        rise = self.y[polygon] * (y[:, None] - self.corner_y[polygon]) + self.slack[polygon]
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = self.corner_x[polygon] - rise / x
        left = np.where(x > 0, bound, -np.inf).max(axis=1)
        right = np.where(x < 0, bound, np.inf).min(axis=1)
        right[((x == 0) & (rise < 0)).any(axis=1)] = -np.inf
        return left, right

    def inside(self, polygon: Indices, x: Array, y: Array) -> tuple[Flags, Flags]:
        """(covered, partial) of the points x, y (N,) [1/256 pixel]."""
        distance = self.x[polygon] * (x[:, None] - self.corner_x[polygon])
        distance += self.y[polygon] * (y[:, None] - self.corner_y[polygon])
        covered = np.all((distance > 0) | ((distance == 0) & self.owns[polygon]), axis=1)
        slack = self.slack[polygon]
        near = np.all(distance >= -slack, axis=1)
        # A polygon whose corners all come to lie on one point has no edge to be far from, and no inside either.
        real = self.real[polygon]
        full = np.all((distance > slack) | ~real, axis=1) & real.any(axis=1)
        return covered, np.logical_and(near, ~full)


def _batches(counts: Indices) -> Iterator[slice]:
    """Slices of `counts` (N,), each of a sum of about PIXELS."""
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
    """start + i counts[i] times over, for every i, and beside each its number from 0."""
    index = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts, counts)
    return index + start, step
