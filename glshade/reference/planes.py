"""Planes: the plane equations of triangles' attributes over the window, and the errors of a driver's float32 equations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.joined_draw import Corners
from glshade.reference import clip
from glshade.reference.division import by_sides
from glshade.reference.freedom import LLVMPIPE, Freedom
from glshade.reference.inputs import Inputs
from glshade.reference.raster import SUBPIXELS, Fragments, U
from glshade.reference.shade import AT_CENTRE, places
from glshade.reference.slivers import Clipped, slimness

Array = NDArray[Any]

# A triangle whose height is less than this may turn over, because snapping moves each corner by up to one step [steps].
FLAT = 4
# The renderer draws pictures with several samples in pieces of at most this size (glshade/gl/tiles.py), and drivers clip
# triangles at a piece's border, too [pixels].
PIECE = 4096


@dataclass(frozen=True, eq=False)
class Depths:
    """The depths that N fragments may have at a pixel's samples, 1 near and 0 far.

    slack: the largest difference (N,) between the driver's depth at a place and the reference's at the same place.
    slope: the changes (N, 2) of the depth from a pixel to the next one to the right and to the next one below.
    nearest: the largest depth (N,) that a driver may find at a sample.
    farthest: the smallest depth (N,) that a driver may find at a sample.
    cut: whether (N,) the driver may have cut the triangle into several, because it reaches beyond the view.
    """

    slack: Array
    slope: Array
    nearest: Array
    farthest: Array
    cut: NDArray[np.bool_]

    def take(self, which: Any) -> Depths:
        """Returns the depths of the fragments that an index array or a mask selects."""
        return Depths(**{f.name: getattr(self, f.name)[which] for f in fields(self)})

    @classmethod
    def joined(cls, parts: Iterable[Depths]) -> Depths:
        """Returns the depths of all parts, in the order of the parts."""
        parts = list(parts) or [cls(np.empty(0), np.empty((0, 2)), np.empty(0), np.empty(0), np.empty(0, dtype=np.bool_))]
        return cls(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)})


def depths(inputs: Inputs, fragments: Fragments, driver: Freedom = LLVMPIPE) -> Depths:
    """Returns the depths that N fragments may have.

    A driver's depth differs from the reference's by errors of the depth's plane equation and by roundings of the depth itself.
    """
    slack, slope = np.zeros(len(fragments)), np.zeros((len(fragments), 2))
    low, high = np.zeros(len(fragments)), np.ones(len(fragments))
    cut = np.zeros(len(fragments), dtype=np.bool_)
    for draw, indices, part in by_sides(inputs, fragments):
        planes = Planes(draw, part, inputs.size, driver)
        error = planes.depth_error()
        # A triangle that is seen edge-on may have any depth of its corners at a pixel, or be drawn with none at all.
        corner = planes.depths[planes.place]
        edge_on = planes.flat | planes.thin[planes.place]
        error = np.where(edge_on, np.maximum(error, np.abs(part.depth[:, None] - corner).max(axis=1)), error)
        slack[indices] = np.where(planes.flat, np.maximum(error, 1.0), error) + 4 * U * np.abs(part.depth)
        cut[indices] = planes.clipped[planes.place] | (max(inputs.size) > PIECE)
        if inputs.extent:
            slope[indices] = np.where(edge_on[:, None], 0.0, planes.depth_slope())
            # All samples of a fragment lie on its triangle, so that their depths lie between those of its corners.
            whole = planes.whole[planes.place] & ~planes.flat
            low[indices] = np.where(whole, corner.min(axis=1), 0.0)
            high[indices] = np.where(whole, corner.max(axis=1), 1.0)
    if not inputs.extent:
        return Depths(slack, slope, fragments.depth + slack, fragments.depth - slack, cut)
    spread = inputs.extent * np.abs(slope).sum(axis=1)
    nearest = np.clip(fragments.depth + spread, low, high) + slack
    return Depths(slack, slope, nearest, np.clip(fragments.depth - spread, low, high) - slack, cut)


def may_turn(inputs: Inputs, fragments: Fragments, driver: Freedom = LLVMPIPE) -> NDArray[np.bool_]:
    """Returns whether each fragment (N,) may show either side, because snapping may turn over its thin triangle."""
    result = np.zeros(len(fragments), dtype=np.bool_)
    for draw, indices, part in by_sides(inputs, fragments):
        if draw.back_faces:
            planes = Planes(draw, part, inputs.size, driver)
            result[indices] = planes.thin[planes.place]
    return result


# Beyond this slimness the error of a triangle's slopes counts twice, for the numerator and for the denominator of the quotient.
# Below it the other terms of the error have room for both. On fans of 1,000 to 30,000 triangles, whose slimness is 100 to
# 5,000, llvmpipe's errors reach half of the result.
NEEDLE = 64.0
# The largest factor by which needle-like triangles may multiply the range of an attribute. All results are then finite.
LARGEST = 1e6


class Planes:
    """The plane equations of N fragments' triangles over the window.

    An attribute divided by clip w is a linear function of the window position: attribute / w = A . (x, y, 1). If the attribute
    has the value a_i at corner i, then A = sum(a_i G_i), where G_i is row i of the triangle's G.

    driver: the errors of the driver's fixed functions.
    size: width and height of the picture [pixels].
    triangles: the rows (T,) of the draw's triangles that have fragments.
    place: the index (N,) of each fragment's triangle in `triangles`.
    corners: the vertices (T, 3) of the triangles.
    G: the plane equations (T, 3, 3), one row per corner.
    B: the plane equations (N, 3) of 1 / w at the fragments' triangles.
    B_size: the sums (N,) of the absolute values of the terms of 1 / w. The rounding error of 1 / w is proportional to them.
    at: the centres (N, 3) of the fragments' pixels, as (x, y, 1) [pixels].
    w: w (N,) at the fragments.
    flat: whether (N,) the triangle is seen edge-on.
    world: the sums (T, 3, 3) of the absolute values of the terms that make up the corners' world positions.
    reach: the error (N, 2) of a fragment's position, relative to its triangle [pixels].
    z: clip z (T, 3) of the corners.
    depths: the depths (T, 3) of the corners, from 0 to 1.
    depth_terms: the sums (N, 2) of the absolute values of the terms that make up clip z and w.
    drawn: the corners (T, E, 3) of the parts of the triangles that are drawn, as (x, y, 1) [pixels]. A clipped triangle may
        have up to 9; others repeat their last one.
    slim: the slimness (N,) of the triangle that a driver draws at the fragment (slivers.py).
    clipped: whether (T,) the driver clips the triangle.
    thin: whether (T,) snapping may turn the triangle over.
    window: x, y of the corners (T, 3, 2) in the picture [pixels]; 0 where a corner lies beyond the near or far plane.
    whole: whether (T,) the reference covers pixels by the whole triangle, and does not clip it (raster.py).
    """

    def __init__(self, draw: Draw | Corners, fragments: Fragments, size: tuple[int, int], driver: Freedom) -> None:
        """Computes the plane equations.

        draw: the instance that is drawn, or the corners of several.
        fragments: N fragments of the draw.
        size: width and height of the picture [pixels].
        driver: the errors of the driver's fixed functions.
        """
        self.driver, self.size = driver, size
        self.triangles, self.place = np.unique(fragments.triangle, return_inverse=True)
        self.corners = draw.triangles[self.triangles]
        at = draw.clip[self.corners]
        w = at[..., 3]
        half = 0.5 * np.array(size)
        rows = np.stack([half[0] * (at[..., 0] + w), half[1] * (at[..., 1] + w), w], axis=-1)
        across = np.stack([np.cross(rows[:, i], rows[:, j]) for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
        volume = np.einsum("ij,ij->i", rows[:, 0], across[:, 0])
        flat = ~(np.abs(volume) > 0)
        self.G = across / np.where(flat, 1.0, volume)[:, None, None]
        x, y = places(fragments, size, AT_CENTRE)
        self.at = np.column_stack([x, y, np.ones(len(x))])
        self.B = self.G.sum(axis=1)[self.place]
        over_w = np.einsum("ij,ij->i", self.B, self.at)
        # A point with w <= 0 lies beyond the horizon of the triangle's plane. Only the coverage margin makes fragments there.
        self.flat = flat[self.place] | ~(over_w > 0)
        self.w = 1 / np.where(self.flat, 1.0, over_w)
        self.B_size = np.einsum("ij,ij->i", np.abs(self.B), self.at)
        # Matrix products are rounded relative to their terms, and window positions relative to the window's size.
        self.world = draw.world_terms[self.corners]
        terms = draw.clip_terms[self.corners].max(axis=1)[self.place]
        screen = np.abs(self.at[:, :2] / half - 1)
        moved = half * (terms[:, :2] + screen * terms[:, 3:]) / np.abs(self.w)[:, None]
        self.reach = driver.window * U * (max(size) + moved) + driver.snap
        self.z, self.depth_terms = at[..., 2], terms[:, 2:]
        self._draw_parts(at, rows[..., :2])

    def _draw_parts(self, at: Array, scaled: Array) -> None:
        """Computes the attributes that say which parts of the triangles are drawn, and how needle-like these are.

        at: the corners (T, 3, 4) in clip space.
        scaled: x, y of the corners in the picture, times their w (T, 3, 2).
        """
        w = at[..., 3]
        code = clip.outside(at)
        behind = (code & clip.DEPTH != 0).any(axis=1)
        self.clipped = (code != 0).any(axis=1) if self.driver.clips else behind
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            self.window = window = np.where(behind[:, None, None], 0.0, scaled / w[..., None])
            self.depths = np.nan_to_num(np.clip(self.z / w, 0, 1))
        self.whole = ~behind & (clip.outside(at, clip.GUARDED) == 0).all(axis=1)
        slim = slimness(window)
        # The height of a triangle is its longest side divided by its slimness.
        longest = np.linalg.norm(np.roll(window, -1, axis=1) - window, axis=2).max(axis=1)
        self.thin = ~behind & (longest <= FLAT * self.driver.step * slim)
        self.slim = slim[self.place]
        self.drawn = np.concatenate([window, np.ones((*window.shape[:2], 1))], axis=2)
        cut = np.flatnonzero(self.clipped)
        if len(cut):
            parts = Clipped.of(at[cut], self.size)
            corners = parts.window.shape[1]
            self.drawn = self.drawn[:, np.minimum(np.arange(corners), 2)]
            self.drawn[cut, :, :2] = parts.window
            row = np.full(len(at), -1)
            row[cut] = np.arange(len(cut))
            which = np.flatnonzero(row[self.place] >= 0)
            self.slim[which] = parts.slimness(row[self.place[which]], self.at[which, :2], self.driver.margin / SUBPIXELS)

    def distance(self, extent: float) -> Array:
        """Returns the distances (N, 3) of squares from the triangles' edges [pixels]. Edge i is opposite corner i.

        A distance is measured to the line through the edge; it is 0 or negative where the line meets the square.
        extent: half the side of the squares round the fragments' centres [pixels].
        """
        lines = self.G[self.place]
        steepness = np.hypot(lines[..., 0], lines[..., 1])
        # An edge without a length is near everything.
        steepness = np.where(steepness > 0, steepness, np.inf)
        away = np.abs(np.einsum("nij,nj->ni", lines, self.at)) - extent * np.abs(lines[..., :2]).sum(axis=2)
        return self._beside(away / steepness, self.window, extent)

    def snapped_distance(self, extent: float) -> Array:
        """As `distance`, with corners snapped as for coverage. Both triangles at an edge have the same distance from it."""
        window = np.rint(self.window * SUBPIXELS) / SUBPIXELS
        start, end = window[:, [1, 2, 0]], window[:, [2, 0, 1]]
        side = (end - start)[self.place]
        away = self.at[:, None, :2] - start[self.place]
        length = np.hypot(side[..., 0], side[..., 1])
        area = np.abs(side[..., 0] * away[..., 1] - side[..., 1] * away[..., 0]) - extent * np.abs(side).sum(axis=2)
        return self._beside(area / np.where(length > 0, length, np.inf), window, extent)

    def _beside(self, distance: Array, window: Array, extent: float) -> Array:
        """Returns the distances (N, 3) of squares from edges, where that of an edge which ends before its square is larger.

        distance: the distances (N, 3) from the lines through the edges [pixels].
        window: x, y of the corners (T, 3, 2) in the picture [pixels].
        extent: as for `distance`.
        """
        if not extent:
            return distance
        start, end = window[:, [1, 2, 0]], window[:, [2, 0, 1]]
        centre = self.at[:, None, :2]
        gap = np.maximum(np.minimum(start, end)[self.place] - centre, centre - np.maximum(start, end)[self.place]).max(axis=2)
        result: Array = np.where(self.whole[self.place, None], np.maximum(distance, gap - extent), distance)
        return result

    def errors(self, corners: Array, vertex: Array | float) -> Array:
        """Returns the errors (N, C) of interpolated attributes at the fragments.

        corners: the values (T, 3, C) of the attributes at the corners.
        vertex: the errors of these values, which broadcast to (T, 3, C).
        """
        by_triangle = np.einsum("tic,tij->tcj", corners, self.G)
        planes = by_triangle[self.place]
        w = self.w[:, None]
        value = w * np.einsum("ncj,nj->nc", planes, self.at)
        size = np.einsum("ncj,nj->nc", np.abs(planes), self.at)
        error = self.driver.plane * U * w * (size + np.abs(value) * self.B_size[:, None])
        slope = np.abs(planes[..., :2] - value[..., None] * self.B[:, None, :2])
        error += np.abs(w) * np.einsum("ncj,nj->nc", slope, self.reach) + 2 * U * np.abs(value)
        weight = np.abs(w * np.einsum("nij,nj->ni", self.G[self.place], self.at))
        needle = self._needle(by_triangle, value)
        # Errors at the corners are interpolated as the attribute is. Beyond the triangle they are extrapolated, as slopes are.
        error += np.abs(w) * weight.sum(axis=1, keepdims=True) * needle
        vertex = np.broadcast_to(vertex, corners.shape)
        error += np.einsum("ni,nic->nc", weight, vertex[self.place])
        span = np.ptp(corners, axis=1)
        result: Array = np.where(self.flat[:, None], span[self.place], error)
        return result

    def depth_error(self) -> Array:
        """Returns the errors (N,) of the depth z/w at the fragments."""
        by_triangle = np.einsum("ti,tij->tj", self.z, self.G)
        plane = by_triangle[self.place]
        size = np.einsum("nj,nj->n", np.abs(plane), self.at)
        steepness = np.einsum("nj,nj->n", np.abs(plane[:, :2]), self.reach)
        depth = np.einsum("nj,nj->n", plane, self.at)
        needle = self._needle(by_triangle[:, None], np.zeros((len(depth), 1)))[:, 0]
        corner = (self.depth_terms[:, 0] + np.abs(depth) * self.depth_terms[:, 1]) / np.abs(self.w)
        result: Array = U * (self.driver.plane * size + self.driver.window * corner) + steepness + needle
        return result

    def depth_slope(self) -> Array:
        """Returns the changes (N, 2) of the depth from a pixel to the next one to the right and to the next one below."""
        plane: Array = np.einsum("ti,tij->tj", self.z, self.G)[self.place, :2]
        return plane

    def over_square(self, corners: Array, vertex: Array | float, extent: float) -> tuple[Array, Array, Array]:
        """Returns (middle, half, error), (N, C) each, of attributes where squares meet the fragments' triangles.

        middle and half are the middle of an attribute's range and half the range; error is the driver's error, as in `errors`.

        A square lies round the centre of each fragment's pixel. An attribute a = (A . p) / (B . p) differs from its value c at
        the centre q by (A - c B) . (p - q) / (B . p), and on the triangle it lies between its values at the corners.
        corners, vertex: as for `errors`.
        extent: half the side of the squares [pixels].
        """
        planes = np.einsum("tic,tij->tcj", corners, self.G)[self.place]
        value = self.w[:, None] * np.einsum("ncj,nj->nc", planes, self.at)
        slope = np.abs(planes[..., :2] - value[..., None] * self.B[:, None, :2]).sum(axis=2)
        # B . p is 1 / w. Where it reaches 0 in the square, the plane has its horizon there, and only the corners are a limit.
        least = 1 / self.w - extent * np.abs(self.B[:, :2]).sum(axis=1)
        bounded = (least > 0) & ~self.flat
        largest = 1 / np.where(bounded, least, 1.0)
        spread = np.where(bounded, extent * largest, 0.0)[:, None] * slope
        low, high = corners.min(axis=1)[self.place], corners.max(axis=1)[self.place]
        error = self.errors(corners, vertex) * np.where(bounded, largest / self.w, 1.0)[:, None]
        first = np.where(bounded[:, None], np.clip(value - spread, low, high), low)
        last = np.where(bounded[:, None], np.clip(value + spread, low, high), high)
        return (first + last) / 2, (last - first) / 2, error

    def _needle(self, planes: Array, value: Array) -> Array:
        """Returns the errors (N, C) of attributes / w that needle-like triangles cause.

        The slopes of a plane equation are quotients. Their numerators and denominators are small differences in a needle-like
        triangle, and their error over the length of the triangle is its slimness times a rounding of the attribute's range.
        planes: the plane equations (T, C, 3) of the attributes / w.
        value: the values (N, C) of the attributes, which the error of 1 / w is multiplied by.
        """
        span = np.ptp(np.einsum("tcj,tej->tec", planes, self.drawn), axis=1)[self.place]
        over_w = np.ptp(np.einsum("tj,tej->te", self.G.sum(axis=1), self.drawn), axis=1)[self.place]
        # A triangle without an area would have an infinite factor.
        factor = np.minimum(self.driver.plane * U * (self.slim + np.maximum(self.slim - NEEDLE, 0)), LARGEST)
        result: Array = factor[:, None] * (span + np.abs(value) * over_w[:, None])
        return result
