"""Sealing: whether the triangles at a pixel certainly cover its centre together, although each of them may miss it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.joined_draw import Corners
from glshade.reference.division import by_sides
from glshade.reference.freedom import LLVMPIPE, Freedom
from glshade.reference.inputs import Inputs
from glshade.reference.planes import FLAT, Planes
from glshade.reference.raster import SUBPIXELS, Fragments

Flags = NDArray[np.bool_]
Indices = NDArray[Any]

# Where the driver's snapped corners are not known, the corners of an edge may lie up to this far beside their places [steps].
MOVED = 2


def sheets(inputs: Inputs, fragments: Fragments, driver: Freedom = LLVMPIPE) -> Indices:
    """Returns the number (N,) of the sheet that each partial fragment belongs to, from 0; -1 if it belongs to none.

    A sheet is a part of a surface that covers the samples of one pixel without a gap. Its fragments are called sealed.

    Two triangles on either side of a shared edge leave no gap there, whichever of them the driver draws. So a fragment is
    sealed if each edge near its pixel's samples has a sealed fragment of that pixel on its other side. A triangle that snapping
    may turn over belongs to a surface of either facing: the surface is continuous, however its corners are snapped, so where a
    triangle is turned over, its neighbours overlap.
    """
    owners, twins, possible, edges = [], [], [], []
    count = 0
    for number, (draw, indices, part) in enumerate(by_sides(inputs, fragments, whole=True)):
        planes = Planes(draw, part, inputs.size, driver)
        near, certain = _near(planes, inputs.extent)
        # Each fragment takes part with the facing that it shows, and with the other one if it may be turned over.
        turned = np.flatnonzero(planes.thin[planes.place]) if draw.back_faces else np.empty(0, dtype=np.intp)
        which = np.concatenate([np.arange(len(part)), turned])
        twin = np.full(len(which), -1)
        twin[turned], twin[len(part) :] = len(part) + np.arange(len(turned)), turned
        front = np.concatenate([part.front, ~part.front[turned]])
        edge = _edges(draw, planes, part.pixel, near, which, front)
        owners.append(indices[which])
        twins.append(np.where(twin >= 0, twin + count, -1))
        possible.append(certain[which])
        edges.append(np.column_stack([edge[:, 0] + count, edge[:, 1:], np.full(len(edge), number)]))
        count += len(which)
    result = np.full(len(fragments), -1)
    if owners:
        edge, twin = np.concatenate(edges), np.concatenate(twins)
        edge = np.column_stack([edge[:, :2], _numbered(edge[:, 2:])])
        kept = _closed(edge, twin, np.concatenate(possible))
        result[np.concatenate(owners)[kept]] = _connected(edge, twin, kept)[kept]
    return result


def _near(planes: Planes, extent: float) -> tuple[Flags, Flags]:
    """Returns (near (N, 3), certain (N,)) of fragments.

    near: whether each edge is near a place where the pixel may have samples; edge i is opposite corner i.
    certain: whether the fragment has a near edge, and no other reason why a driver may leave it out.
    extent: half the side of the square round the pixel's centre in which the pixel has its samples [pixels].
    """
    driver = planes.driver
    margin = driver.margin / SUBPIXELS
    thin = planes.thin[planes.place]
    # The far edge of a thin triangle counts as near, too.
    reserve = np.where(thin, FLAT * driver.step, 0.0)
    # The margin of coverage, the snapping of the edge's corners, and the error of their places before that.
    distance = margin + MOVED * driver.step + planes.reach.max(axis=1)
    # The reference snaps corners as a driver does that has a grid of the same size, so that they are known.
    known = planes.whole[planes.place] & (planes.reach.max(axis=1) < driver.step) & (driver.step <= 1 / SUBPIXELS)
    near = np.where(
        known[:, None],
        planes.snapped_distance(extent) <= (margin + reserve)[:, None],
        planes.distance(extent) <= (distance + reserve)[:, None],
    )
    # Where a driver clips a triangle, the new edge is also only drawn to within the distance of the picture's border.
    centre = planes.at[:, :2]
    inward = np.minimum(centre, planes.size - centre) - extent
    border = planes.clipped[planes.place] & (inward <= distance[:, None]).any(axis=1)
    return near, near.any(axis=1) & ~border & ~planes.flat


def _edges(draw: Draw | Corners, planes: Planes, pixel: Indices, near: Flags, which: Indices, front: Flags) -> Indices:
    """Returns a row (holder, direction, pixel, one end, other end) for each near edge of each of M participants.

    pixel: the pixel (N,) of each fragment.
    near: whether (N, 3) each edge of a fragment is near.
    which: the fragment (M,) of each participant.
    front: the facing (M,) of each participant.
    """
    vertices, place = np.unique(planes.corners, return_inverse=True)
    _, position_id = np.unique(draw.identities[vertices], axis=0, return_inverse=True)
    corner = position_id.reshape(-1)[place.reshape(-1, 3)][planes.place]
    rows = []
    for k in range(3):
        holder = np.flatnonzero(near[which, k])
        fragment = which[holder]
        a, b = corner[fragment, (k + 1) % 3], corner[fragment, (k + 2) % 3]
        # Neighbours of the same facing run along their shared edge in opposite directions.
        direction = (a < b) == front[holder]
        rows.append(np.column_stack([holder, direction, pixel[fragment], np.minimum(a, b), np.maximum(a, b)]))
    return np.concatenate(rows)


def _closed(edges: Indices, twin: Indices, possible: Flags) -> Flags:
    """Returns the participants (M,) whose every near edge has another one on its other side.

    All possible ones count at first. Those with an edge that has none on its other side are removed, until all are closed.
    edges: rows (holder, direction, number of the edge in its pixel).
    twin: the participant (M,) of the same fragment with the other facing, -1 if there is none. It does not count as another
        one, although it runs along the edge in the other direction.
    possible: whether (M,) the participant may be sealed at all.
    """
    holder, direction, edge = edges.T
    kept = possible.copy()
    here, beyond = 2 * edge + direction, 2 * edge + 1 - direction
    count = 2 * int(edge.max(initial=-1)) + 2
    while True:
        current = kept[holder]
        number = np.bincount(here[current], minlength=count)
        others = number[beyond] - ((twin >= 0) & kept[twin])[holder]
        lonely = current & (others <= 0)
        if not lonely.any():
            return kept
        kept[holder[lonely]] = False


def _connected(edges: Indices, twin: Indices, kept: Flags) -> Indices:
    """Returns a number (M,) for each participant; those that are connected by shared edges have the same number.

    edges, twin: as for `_closed`.
    kept: whether (M,) the participant is sealed. The others connect nothing.
    """
    holder, _, edge = edges[kept[edges[:, 0]]].T
    pair = np.flatnonzero((twin >= 0) & kept & kept[twin])
    # Each edge is a node beside the participants that hold it.
    first, second = np.concatenate([holder, pair]), np.concatenate([len(twin) + edge, twin[pair]])
    # Every node takes the least number among those that it is connected to, until no number changes. Few steps are enough,
    # because a part of a surface lies within one pixel. To import SciPy for this would take longer than most calls.
    number = np.arange(len(twin) + int(edges[:, 2].max(initial=-1)) + 1)
    while len(apart := np.flatnonzero(number[first] != number[second])):
        first, second = first[apart], second[apart]
        least = np.minimum(number[first], number[second])
        for node in (first, second):
            np.minimum.at(number, number[node], least)
        while (number[number] != number).any():
            number = number[number]
    return number[: len(twin)]


def _numbered(rows: Indices) -> Indices:
    """Returns a number (N,) for each row (N, C) of whole numbers from 0; equal rows have equal numbers.

    Sorting one column after the other is much faster than sorting whole rows. The numbers of rows, of pixels and of corners are
    so small that their products fit into 63 bits.
    """
    result = np.zeros(len(rows), dtype=np.int64)
    for column in rows.T:
        _, result = np.unique(result * (int(column.max(initial=0)) + 1) + column, return_inverse=True)
    return result
