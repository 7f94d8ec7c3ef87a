"""Polygon: cuts a polygon in space into triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glshade.limits import MOST_CORNERS


def triangulated(outline: npt.ArrayLike) -> list[tuple[int, int, int]]:
    """Returns the triangles, as indices of corners, of a polygon (N, 3) that is nearly flat and does not cross itself.

    The triangles have the orientation of the polygon. A convex polygon becomes a fan around its first corner. Any other polygon
    is cut up ear by ear (Meisters 1975). Errors: ValueError for one with more than MOST_CORNERS corners.
    """
    p = np.asarray(outline, dtype=np.float64)
    count = len(p)
    fan = [(0, k, k + 1) for k in range(1, count - 1)]
    following = np.roll(p, -1, axis=0)
    normal = np.cross(p - p[0], following - p[0]).sum(axis=0)  # twice the area along the normal, for any outline (Newell)
    if not np.isfinite(p).all() or not normal.any():
        return fan
    drop = int(np.abs(normal).argmax())
    keep = [[1, 2], [2, 0], [0, 1]][drop]
    flat = (p[:, keep] * [1.0, np.sign(normal[drop])]).tolist()  # the outline is counter-clockwise in these two dimensions

    def turn(a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = flat[a], flat[b], flat[c]
        return float((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))

    if all(turn(k - 1, k, (k + 1) % count) >= 0 for k in range(count)):
        return fan
    if count > MOST_CORNERS:
        raise ValueError(f"a polygon that is not convex has {count:,} corners; {MOST_CORNERS:,} are allowed")
    left = list(range(count))
    ears = []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            if turn(a, b, c) > 0 and not any(
                turn(a, b, x) >= 0 and turn(b, c, x) >= 0 and turn(c, a, x) >= 0 for x in left if x not in (a, b, c)
            ):
                break
        else:
            k = 0  # the outline crosses itself, and any triangle is as good as another
            a, b, c = left[-1], left[0], left[1]
        ears.append((a, b, c))
        del left[k]
    return [*ears, (left[0], left[1], left[2])]
