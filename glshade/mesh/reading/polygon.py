"""Polygon: cuts a polygon in space into triangles."""

from __future__ import annotations

from collections import defaultdict, deque

import numpy as np
import numpy.typing as npt

from glshade.arrays import Float64
from glshade.limits import MOST_CORNERS


def triangulated(outline: npt.ArrayLike) -> list[tuple[int, int, int]]:
    """Returns the triangles, as indices of corners, of a polygon (N, 3) that is nearly flat and does not cross itself.

    The N - 2 triangles have the orientation of the polygon. A convex polygon becomes a fan around its first corner. Any other
    polygon is cut up ear by ear (Meisters 1975). Corners on straight sides are kept, because a neighbour may use them, too.
    Errors: ValueError for one with more than MOST_CORNERS corners that is not convex.
    """
    p = np.asarray(outline, dtype=np.float64)
    count = len(p)
    with np.errstate(all="ignore"):
        rays = p - p[0]
        # Twice the area along the normal, for any outline (Newell).
        normal = np.cross(rays, np.roll(rays, -1, axis=0)).sum(axis=0)
    if count > 3 and np.isfinite(normal).all() and normal.any():
        drop = int(np.abs(normal).argmax())
        keep = [[1, 2], [2, 0], [0, 1]][drop]
        # The outline is counter-clockwise in these two dimensions. A size of 1 keeps its areas from overflowing.
        flat = rays[:, keep] / np.abs(rays).max() * [1.0, np.sign(normal[drop])]
        if (_turns(np.roll(flat, 1, axis=0), flat, np.roll(flat, -1, axis=0)) < 0).any():
            if count > MOST_CORNERS:
                raise ValueError(f"a polygon that is not convex has {count:,} corners; {MOST_CORNERS:,} are allowed")
            return _Clipping(flat).triangles()
    return [(0, k, k + 1) for k in range(1, count - 1)]


def _turns(a: Float64, b: Float64, c: Float64) -> Float64:
    """Returns twice the signed areas (N,) of the triangles a, b, c (N, 2): positive where a corner b turns to the left."""
    result: Float64 = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return result


class _Clipping:
    """A polygon whose ears are cut off one by one.

    An ear is a corner that turns to the left and whose triangle holds no corner that turns to the right. A corner that is no
    ear because of such a blocker is looked at again only when the blocker is cut off or turns to the left, or when one of its
    own neighbours changes. So an outline as it occurs in practice takes about three tests a corner.
    """

    def __init__(self, flat: Float64) -> None:
        """flat: the outline (N, 2), counter-clockwise."""
        count = len(flat)
        self._points: list[tuple[float, float]] = [(x, y) for x, y in flat.tolist()]
        self._next = [*range(1, count), 0]
        self._last = [count - 1, *range(count - 1)]
        turns = _turns(np.roll(flat, 1, axis=0), flat, np.roll(flat, -1, axis=0))
        # The corners that turn to the right, by their first coordinate: a triangle is compared with those in its range alone.
        blockers = np.flatnonzero(turns < 0)
        self._blockers = blockers[np.argsort(flat[blockers, 0], kind="stable")]
        self._xs, self._ys = flat[self._blockers].T.copy()
        self._place = {int(corner): place for place, corner in enumerate(self._blockers)}
        self._alive = np.ones(len(blockers), dtype=bool)
        # Blocker -> the corners that wait for it.
        self._waiting: defaultdict[int, list[int]] = defaultdict(list)

    def triangles(self) -> list[tuple[int, int, int]]:
        """Returns the triangles."""
        left = len(self._points)
        queue = deque(range(left))
        present = [True] * left
        result = []
        while left > 3:
            if queue:
                corner = queue.popleft()
                if not present[corner] or not self._is_ear(corner):
                    continue
            else:
                # The outline crosses itself, and any triangle is as good as another.
                corner = next(k for k, there in enumerate(present) if there)
            a, c = self._last[corner], self._next[corner]
            result.append((a, corner, c))
            present[corner] = False
            left -= 1
            self._next[a], self._last[c] = c, a
            queue.extend((a, c))
            queue.extend(self._released(corner))
            for end in (a, c):
                if self._turn(self._last[end], end, self._next[end]) >= 0:
                    queue.extend(self._released(end))
        first = next(k for k, there in enumerate(present) if there)
        return self._straightened([*result, (first, self._next[first], self._last[first])])

    def _straightened(self, triangles: list[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
        """Returns the triangles, none of which is a mere line if that can be avoided.

        Where a triangle's corner lies on its opposite side, that side is shared with another triangle. The side is replaced by
        the line from the corner to the other triangle's free corner.
        """
        owners = {(t[k - 1], t[k]): index for index, t in enumerate(triangles) for k in range(3)}
        lines = [index for index, t in enumerate(triangles) if self._turn(*t) == 0]
        for _ in range(2 * len(triangles)):  # every line needs one step, and may make another line of its neighbour
            if not lines:
                break
            index = lines.pop()
            m, x, y = max(
                (t[k:] + t[:k] for t in [triangles[index]] for k in range(3)), key=lambda t: self._length2(t[1], t[2])
            )
            other = owners.get((y, x))
            if other is None:
                continue
            free = next(corner for corner in triangles[other] if corner not in (x, y))
            if self._turn(m, x, free) < 0 or self._turn(m, free, y) < 0:
                continue
            for place, t in ((index, (m, x, free)), (other, (m, free, y))):
                triangles[place] = t
                owners |= {(t[k - 1], t[k]): place for k in range(3)}
                if self._turn(*t) == 0:
                    lines.append(place)
        return triangles

    def _length2(self, a: int, b: int) -> float:
        (ax, ay), (bx, by) = self._points[a], self._points[b]
        return (bx - ax) ** 2 + (by - ay) ** 2

    def _turn(self, a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = self._points[a], self._points[b], self._points[c]
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    def _released(self, corner: int) -> list[int]:
        """Returns the corners that waited for one which blocks nothing any more."""
        place = self._place.pop(corner, None)
        if place is not None:
            self._alive[place] = False
        return self._waiting.pop(corner, [])

    def _is_ear(self, b: int) -> bool:
        a, c = self._last[b], self._next[b]
        if self._turn(a, b, c) <= 0:
            return False
        corners = self._points[a], self._points[b], self._points[c]
        least, *_, greatest = sorted(x for x, _ in corners)
        first, end = np.searchsorted(self._xs, least), np.searchsorted(self._xs, greatest, side="right")
        x, y, within = self._xs[first:end], self._ys[first:end], self._alive[first:end].copy()
        for (px, py), (qx, qy) in zip(corners, (corners[1], corners[2], corners[0]), strict=True):
            within &= (qx - px) * (y - py) - (qy - py) * (x - px) >= 0
            # Where a cut leads to a hole and back, two corners lie at one place. They do not block each other.
            within &= (x != px) | (y != py)
        if not within.any():
            return True
        self._waiting[int(self._blockers[first + within.argmax()])].append(b)
        return False
