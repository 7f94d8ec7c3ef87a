"""Planes: the plane equations of triangles' attributes over the window, and the errors of a driver's float32 equations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.reference import clip
from glshade.reference.freedom import LLVMPIPE, Freedom, U
from glshade.reference.inputs import Inputs
from glshade.reference.raster import MARGIN, SUBPIXELS, Fragments
from glshade.reference.shade import AT_CENTRE, by_draw, places

Array = NDArray[Any]


# An edge within this distance of a pixel's centre counts as near [pixels]. The distance is the margin of coverage and two
# snapping steps for the corners of the edge.
NEAR = (MARGIN + 2) / SUBPIXELS
# A triangle whose height is less than this may turn over, because snapping moves each corner by up to one step [pixels].
FLAT = 4 / SUBPIXELS


def depth_slack(inputs: Inputs, fragments: Fragments, driver: Freedom = LLVMPIPE) -> Array:
    """The largest difference (N,) between the driver's depth and the reference's.

    The difference comes from the plane equation of the depth and from roundings of the depth itself.
    """
    result = np.zeros(len(fragments))
    for draw, indices, part in by_draw(inputs, fragments):
        planes = Planes(draw, part, inputs.size, driver)
        error = planes.depth_error()
        # A triangle that is seen edge-on may have any depth at a pixel.
        result[indices] = np.where(planes.flat, 1.0, error) + 4 * U * np.abs(part.depth)
    return result


def may_turn(inputs: Inputs, fragments: Fragments) -> NDArray[np.bool_]:
    """Whether each fragment (N,) may show either side, because snapping may turn over its thin triangle."""
    result = np.zeros(len(fragments), dtype=np.bool_)
    for draw, indices, part in by_draw(inputs, fragments):
        if draw.instance.back_faces:
            planes = Planes(draw, part, inputs.size, LLVMPIPE)
            result[indices] = planes.thin[planes.place]
    return result


def is_sealed(inputs: Inputs, fragments: Fragments) -> NDArray[np.bool_]:
    """Whether each partial fragment (N,) belongs to a surface that covers its pixel's centre without a gap.

    Two triangles on either side of a shared edge leave no gap there, whichever of them the driver draws. So a fragment is
    sealed if each edge near its pixel's centre has a sealed fragment of that pixel on its other side.
    """
    sealed = np.zeros(len(fragments), dtype=np.bool_)
    owners, keys, directions = [], [], []
    for number, draw in enumerate(inputs.draws):
        indices = np.flatnonzero(fragments.draw == number)
        if not len(indices):
            continue
        part = fragments.take(indices)
        planes = Planes(draw, part, inputs.size, LLVMPIPE)
        # Row i of G is the line through the edge opposite to corner i.
        lines = planes.G[planes.place]
        steepness = np.hypot(lines[..., 0], lines[..., 1])
        near = np.abs(np.einsum("nij,nj->ni", lines, planes.at)) <= NEAR * steepness
        sealed[indices] = near.any(axis=1) & ~planes.flat & ~planes.thin[planes.place]
        vertices, place = np.unique(planes.corners, return_inverse=True)
        # Vertices at the same position are the same corner, whatever their other attributes are.
        _, position_id = np.unique(draw.instance.mesh.positions[vertices] + 0.0, axis=0, return_inverse=True)
        corner = position_id.reshape(-1)[place.reshape(-1, 3)][planes.place]
        for k in range(3):
            with_edge = np.flatnonzero(near[:, k])
            a, b = corner[with_edge, (k + 1) % 3], corner[with_edge, (k + 2) % 3]
            owners.append(indices[with_edge])
            draws = np.full(len(with_edge), number)
            keys.append(np.column_stack([part.pixel[with_edge], draws, np.minimum(a, b), np.maximum(a, b)]))
            # Neighbours of the same facing run along their shared edge in opposite directions.
            directions.append((a < b) == part.front[with_edge])
    if not owners:
        return sealed
    owner, direction = np.concatenate(owners), np.concatenate(directions)
    _, edge = np.unique(np.concatenate(keys), axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    # All candidates count as sealed at first. Those with an edge that has no sealed fragment on its other side are removed,
    # until every remaining one is sealed.
    while True:
        current = sealed[owner]
        both = np.zeros((int(edge.max(initial=-1)) + 1, 2), dtype=np.bool_)
        both[edge[current], direction[current].astype(np.intp)] = True
        lonely = current & ~both[edge].all(axis=1)
        if not lonely.any():
            return sealed
        sealed[owner[lonely]] = False


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
    at: the fragments' centres (N, 3), as (x, y, 1) [pixels].
    w: w (N,) at the fragments.
    flat: whether (N,) the triangle is seen edge-on.
    world: the sums (T, 3, 3) of the absolute values of the terms that make up the corners' world positions.
    reach: the error (N, 2) of a fragment's position, relative to its triangle [pixels].
    z: clip z (T, 3) of the corners.
    depth_terms: the sums (N, 2) of the absolute values of the terms that make up clip z and w.
    over_w: 1 / w (T, 3) at the corners.
    slim: longest side^2 / (2 area) of each triangle (T,), a factor of the errors of needle-like triangles.
    behind: whether (T,) a corner lies beyond the near or far plane.
    thin: whether (T,) snapping may turn the triangle over.
    """

    def __init__(self, draw: Draw, fragments: Fragments, size: tuple[int, int], driver: Freedom) -> None:
        """Computes the plane equations.

        draw: the instance that is drawn.
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
        matrix = np.abs(draw.world_from_object)
        self.world = np.abs(draw.instance.mesh.positions[self.corners]) @ matrix[:3, :3].T + matrix[:3, 3]
        project = np.abs(draw.clip_from_world)
        terms = (self.world @ project[:, :3].T + project[:, 3]).max(axis=1)[self.place]
        screen = np.abs(self.at[:, :2] / half - 1)
        moved = half * (terms[:, :2] + screen * terms[:, 3:]) / np.abs(self.w)[:, None]
        self.reach = driver.window * U * (max(size) + moved) + driver.snap
        self.z, self.depth_terms = at[..., 2], terms[:, 2:]
        # The plane equation of a needle-like triangle is a quotient of small differences. Its error is L^2 / (2 area)
        # roundings, where L is the longest side.
        behind = (clip.outside(at) & 0b110000 != 0).any(axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            window = rows[..., :2] / w[..., None]
            sides = window[:, [1, 2, 0]] - window
            double = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
            longest = (sides**2).sum(axis=2).max(axis=1)
            slim = longest / double
            thin = double <= FLAT * np.sqrt(longest)
            self.over_w = 1 / w
        self.slim = np.where(behind | ~np.isfinite(slim), 1.0, slim)
        self.behind, self.thin = behind, thin & ~behind

    def errors(self, corners: Array, vertex: Array | float) -> Array:
        """The errors (N, C) of interpolated attributes at the fragments.

        corners: the values (T, 3, C) of the attributes at the corners.
        vertex: the errors of these values, which broadcast to (T, 3, C).
        """
        planes = np.einsum("tic,tij->tcj", corners, self.G)[self.place]
        w = self.w[:, None]
        value = w * np.einsum("ncj,nj->nc", planes, self.at)
        size = np.einsum("ncj,nj->nc", np.abs(planes), self.at)
        error = self.driver.plane * U * w * (size + np.abs(value) * self.B_size[:, None])
        slope = np.abs(planes[..., :2] - value[..., None] * self.B[:, None, :2])
        error += np.abs(w) * np.einsum("ncj,nj->nc", slope, self.reach) + 2 * U * np.abs(value)
        span = np.ptp(corners, axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            needle = self.slim[:, None] * np.where(self.behind[:, None], span, np.ptp(corners * self.over_w[..., None], axis=1))
        error += self.driver.plane * U * np.where(self.behind[self.place], 1.0, self.w)[:, None] * needle[self.place]
        error += np.broadcast_to(vertex, corners.shape).max(axis=1)[self.place]
        result: Array = np.where(self.flat[:, None], span[self.place], error)
        return result

    def depth_error(self) -> Array:
        """The errors (N,) of the depth z/w at the fragments."""
        plane = np.einsum("ti,tij->tj", self.z, self.G)[self.place]
        size = np.einsum("nj,nj->n", np.abs(plane), self.at)
        steepness = np.einsum("nj,nj->n", np.abs(plane[:, :2]), self.reach)
        depth = np.einsum("nj,nj->n", plane, self.at)
        corner = (self.depth_terms[:, 0] + np.abs(depth) * self.depth_terms[:, 1]) / np.abs(self.w)
        result: Array = U * (self.driver.plane * size + self.driver.window * corner) + steepness
        return result
