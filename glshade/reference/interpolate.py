"""Interpolate: perspective-correct barycentric weights, and their derivatives across the picture (OpenGL 4.6 core, 14.6.1).

The weights come from the exact corners, not from the corners that are snapped for coverage. llvmpipe does the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.joined_draw import Corners

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Weights:
    """The weights of the three corners of triangles at N points.

    values: the weights (N, 3), which sum to 1.
    dx: their derivatives (N, 3) to the right [1/pixel]; empty if they were not asked for.
    dy: their derivatives (N, 3) downward [1/pixel]; empty if they were not asked for.
    depth: the depth (N,) at the points, which is clip z divided by clip w: 1 near and 0 far.
    """

    values: Array
    dx: Array
    dy: Array
    depth: Array


def weights(
    draw: Draw | Corners,
    triangle: NDArray[Any],
    x: NDArray[Any],
    y: NDArray[Any],
    size: tuple[int, int],
    derivatives: bool = True,
) -> Weights:
    """Returns the weights of triangles at points of the picture.

    Let p_i be a triangle's corners in homogeneous coordinates. The weights beta_i of a point q make sum(beta_i p_i)
    proportional to q. With the corners moved so that q is the origin, beta_i is the cross product of the other two corners
    (Olano and Greer 1997). This also holds for corners behind the eye.
    draw: the instance that is drawn, or the corners of several.
    triangle: the rows (N,) of its triangles, one for each point.
    x: the points' x (N,) [pixels]; the centre of pixel i lies at i + 0.5.
    y: the points' y (N,) [pixels]; row 0 is at the top.
    size: width and height of the picture [pixels].
    derivatives: whether to compute dx and dy.
    """
    corners = draw.clip[draw.triangles[triangle]]
    w = corners[..., 3]
    across = 0.5 * size[0] * (corners[..., 0] + w) - x[:, None] * w
    down = 0.5 * size[1] * (corners[..., 1] + w) - y[:, None] * w
    second, third = [1, 2, 0], [2, 0, 1]
    beta = across[:, second] * down[:, third] - across[:, third] * down[:, second]
    total = beta.sum(axis=1)
    # A triangle that is seen edge-on has no area, and every point on it is a valid answer: its centroid is taken.
    flat = ~(np.abs(total) > 0)
    beta[flat], total[flat] = 1.0, 3.0
    values = beta / total[:, None]
    depth = np.einsum("ij,ij->i", values, corners[..., 2]) / np.einsum("ij,ij->i", values, w)
    none = np.empty((0, 3))
    if not derivatives:
        return Weights(values, none, none, depth)
    dx = w[:, third] * down[:, second] - w[:, second] * down[:, third]
    dy = w[:, second] * across[:, third] - w[:, third] * across[:, second]
    dx, dy = ((d - values * d.sum(axis=1, keepdims=True)) / total[:, None] for d in (dx, dy))
    dx[flat], dy[flat] = 0.0, 0.0
    return Weights(values, dx, dy, depth)


def blend(weight: Array, corners: NDArray[np.floating]) -> Array:
    """Returns the means (N, C) of the values (N, 3, C) at the corners of triangles, with the weights (N, 3)."""
    result: Array = np.einsum("ij,ijk->ik", weight, corners)
    return result
