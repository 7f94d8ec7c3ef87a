"""Visible: the surfaces that a picture shows, and the points at which they are shaded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.surface import Surface, at_vertices
from glshade.reference.division import by_draw
from glshade.reference.inputs import Inputs
from glshade.reference.interpolate import weights
from glshade.reference.raster import Fragments, rasterise, resolve
from glshade.reference.shade import AT_CENTRE, is_there, places, surface_at

Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class VisiblePart:
    """The part of an instance that a picture shows.

    draw: the instance.
    pixel: (N,), the numbers of the pixels that show it, row * width + column in the whole picture.
    surface: the M points at which it is shaded for these pixels.
    point: (N,), the point that each pixel shows. With Gouraud shading, that is the nearest corner of the pixel's triangle.
    """

    draw: Draw
    pixel: Indices
    surface: Surface
    point: Indices


def visible_parts(inputs: Inputs) -> Iterator[VisiblePart]:
    """Yields the visible part of each instance that a picture shows. A blended surface hides what lies behind it."""
    nearest, layers = resolve(inputs, rasterise(inputs), lambda fragments: is_there(inputs, fragments, AT_CENTRE))
    # The layers of a pixel are in drawing order, and the last one is the nearest.
    front = layers.take(np.flatnonzero(np.diff(layers.pixel, append=-1) != 0))
    fragments = Fragments.joined([nearest.take(~np.isin(nearest.pixel, front.pixel)), front])
    for draw, _, part in by_draw(inputs, fragments, whole=True):
        yield VisiblePart(draw, part.pixel.astype(np.intp), *_points(draw, part, inputs.size))


def _points(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> tuple[Surface, Indices]:
    """Returns the points at which a draw is shaded, and the point (N,) that each of its fragments shows."""
    if draw.instance.rate == "phong":
        surface = surface_at(draw, fragments, size, AT_CENTRE)
        side = np.where(fragments.front | (not draw.instance.back_faces), 1.0, -1.0)
        return replace(surface, side=side), np.arange(len(fragments))
    corners: NDArray[Any] = draw.triangles[fragments.triangle]
    if draw.instance.rate == "gouraud":
        nearest = weights(draw, fragments.triangle, *places(fragments, size, AT_CENTRE), size, derivatives=False).values
        corners = np.take_along_axis(corners, nearest.argmax(axis=1)[:, None], axis=1)
        vertices, points = np.unique(corners[:, 0], return_inverse=True)
        return at_vertices(draw, vertices, np.float64), points
    # With flat shading, the last vertex of a face holds its centroid.
    vertices, points = np.unique(corners[:, 2], return_inverse=True)
    return at_vertices(draw, vertices, np.float64, centroids=True), points
