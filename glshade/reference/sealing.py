"""Sealing: whether the triangles at a pixel certainly cover its centre together, although each of them may miss it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.reference.freedom import LLVMPIPE, Freedom
from glshade.reference.inputs import Inputs
from glshade.reference.planes import FLAT, Planes
from glshade.reference.raster import MARGIN, SUBPIXELS, Fragments

Flags = NDArray[np.bool_]
Indices = NDArray[Any]

# An edge within this distance of a pixel's centre counts as near where the driver's snapped corners are not known [pixels]. The
# distance is the margin of coverage and two snapping steps for the corners of the edge.
NEAR = (MARGIN + 2) / SUBPIXELS


def is_sealed(inputs: Inputs, fragments: Fragments, driver: Freedom = LLVMPIPE) -> Flags:
    """Returns whether each partial fragment (N,) belongs to a surface that covers its pixel's centre without a gap.

    Two triangles on either side of a shared edge leave no gap there, whichever of them the driver draws. So a fragment is
    sealed if each edge near its pixel's centre has a sealed fragment of that pixel on its other side. A triangle that snapping
    may turn over belongs to a surface of either facing: the surface is continuous, however its corners are snapped, so where a
    triangle is turned over, its neighbours overlap.
    """
    owners, twins, possible, edges = [], [], [], []
    count = 0
    for number, draw in enumerate(inputs.draws):
        indices = np.flatnonzero(fragments.draw == number)
        if not len(indices):
            continue
        part = fragments.take(indices)
        planes = Planes(draw, part, inputs.size, driver)
        near, certain = _near(planes)
        # Each fragment takes part with the facing that it shows, and with the other one if it may be turned over.
        turned = np.flatnonzero(planes.thin[planes.place]) if draw.instance.back_faces else np.empty(0, dtype=np.intp)
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
    sealed = np.zeros(len(fragments), dtype=np.bool_)
    if owners:
        kept = _closed(np.concatenate(edges), np.concatenate(twins), np.concatenate(possible))
        sealed[np.concatenate(owners)[kept]] = True
    return sealed


def _near(planes: Planes) -> tuple[Flags, Flags]:
    """Returns (near (N, 3), certain (N,)) of fragments.

    near: whether each edge is near the pixel's centre; edge i is opposite corner i.
    certain: whether the fragment has a near edge, and no other reason why a driver may leave it out.
    """
    thin = planes.thin[planes.place]
    # The far edge of a thin triangle counts as near, too.
    reserve = np.where(thin, FLAT, 0.0)
    distance = NEAR + planes.reach.max(axis=1)
    near = np.where(
        (planes.whole[planes.place] & (distance < NEAR + 1 / SUBPIXELS))[:, None],
        planes.snapped_distance() <= (MARGIN / SUBPIXELS + reserve)[:, None],
        planes.distance() <= (distance + reserve)[:, None],
    )
    # Where a driver clips a triangle, the new edge is also only drawn to within the distance of the picture's border.
    centre = planes.at[:, :2]
    border = planes.clipped[planes.place] & (np.minimum(centre, planes.size - centre) <= distance[:, None]).any(axis=1)
    return near, near.any(axis=1) & ~border & ~planes.flat


def _edges(draw: Draw, planes: Planes, pixel: Indices, near: Flags, which: Indices, front: Flags) -> Indices:
    """Returns a row (holder, direction, pixel, one end, other end) for each near edge of each of M participants.

    pixel: the pixel (N,) of each fragment.
    near: whether (N, 3) each edge of a fragment is near.
    which: the fragment (M,) of each participant.
    front: the facing (M,) of each participant.
    """
    vertices, place = np.unique(planes.corners, return_inverse=True)
    # Vertices at the same position are the same corner, whatever their other attributes are.
    _, position_id = np.unique(draw.instance.mesh.positions[vertices] + 0.0, axis=0, return_inverse=True)
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
    edges: the rows of `_edges`, followed by the number of the draw.
    twin: the participant (M,) of the same fragment with the other facing, -1 if there is none. It does not count as another
        one, although it runs along the edge in the other direction.
    possible: whether (M,) the participant may be sealed at all.
    """
    holder, direction = edges[:, 0], edges[:, 1]
    _, edge = np.unique(edges[:, 2:], axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    kept = possible.copy()
    while True:
        current = kept[holder]
        number = np.zeros((int(edge.max(initial=-1)) + 1, 2), dtype=np.intp)
        np.add.at(number, (edge[current], direction[current]), 1)
        others = number[edge, 1 - direction] - ((twin >= 0) & kept[twin])[holder]
        lonely = current & (others <= 0)
        if not lonely.any():
            return kept
        kept[holder[lonely]] = False
