"""Slivers: the triangles into which a driver splits a triangle that it clips, and how needle-like they are.

A driver clips a triangle to the view volume and splits the rest into triangles. Their corners lie on the volume's faces. If an
original corner lies just outside of the view, two of the new corners are close together, and a triangle between them and a
distant corner is a sliver. The specification does not say how the rest is split.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.reference import clip

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Clipped:
    """The parts of T triangles inside the view volume: convex polygons of up to E corners.

    window: x, y of the corners (T, E, 2) in the picture [pixels]. A polygon with fewer corners repeats its last one.
    count: the numbers of corners (T,).
    """

    window: Array
    count: NDArray[np.intp]

    @classmethod
    def of(cls, triangles: Array, size: tuple[int, int]) -> Clipped:
        """Returns the clipped triangles. triangles: (T, 3, 4) in clip space. size: width and height of the picture [pixels]."""
        polygons, counts = clip.cut(triangles)
        polygons = polygons[:, : max(int(counts.max(initial=3)), 3)]
        # A polygon that is empty has no fragments, except by the margin of coverage; its corners must only be finite.
        polygons[counts < 3] = (0.0, 0.0, 0.0, 1.0)
        return cls((polygons[..., :2] / polygons[..., 3:] + 1) * (0.5 * np.array(size)), counts)

    def slimness(self, place: NDArray[np.intp], points: Array, margin: float) -> Array:
        """Returns the slimness (N,) of the most needle-like triangle that a driver may draw at each point.

        These are all triangles of three corners of the polygon that contain the point.
        place: the index (N,) of each point's polygon.
        points: x, y of the points (N, 2) [pixels].
        margin: the distance from a triangle at which a point still counts as inside [pixels].
        """
        result = np.ones(len(points))
        for three in combinations(range(self.window.shape[1]), 3):
            which = np.flatnonzero(self.count[place] > three[-1])
            corners = self.window[:, three]
            sides = np.roll(corners, -1, axis=1) - corners
            length = np.hypot(sides[..., 0], sides[..., 1])
            turn = np.where(_double_area(sides) < 0, -1.0, 1.0)
            row = place[which]
            away, side = points[which, None] - corners[row], sides[row]
            # The distance from a side, times the side's length, is positive inside.
            distance = turn[row, None] * (side[..., 0] * away[..., 1] - side[..., 1] * away[..., 0])
            inside = (distance >= -margin * length[row]).all(axis=1)
            result[which] = np.where(inside, np.maximum(result[which], slimness(corners)[row]), result[which])
        return result


def slimness(corners: Array) -> Array:
    """Longest side^2 / (2 area) of triangles (T,), at least 1, with infinity where the area is 0 but a side has a length.

    The plane equation of an attribute is a quotient of small differences in a needle-like triangle, and its error is this many
    roundings.
    corners: x, y of the triangles' corners (T, 3, 2) [pixels].
    """
    sides = np.roll(corners, -1, axis=1) - corners
    longest = (sides**2).sum(axis=2).max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        result: Array = np.fmax(longest / np.abs(_double_area(sides)), 1.0)
    return result


def _double_area(sides: Array) -> Array:
    """Returns twice the signed areas (T,) of triangles. sides: (T, 3, 2)."""
    area: Array = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    return area
