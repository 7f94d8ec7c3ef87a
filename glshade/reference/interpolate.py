"""Interpolate: barycentric weights, perspective-correct, and their derivatives across the picture. OpenGL 4.6 core, 14.6.1.

From the positions as they are, not as they are snapped for coverage: that is what drivers do, and what a surface is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Weights:
    """Of a triangle's three corners at some points: values (N, 3), which sum to 1, and their change a pixel, dx and dy (N, 3).

    depth (N,): z/w there, 1 near and 0 far.
    """

    values: Array
    dx: Array
    dy: Array
    depth: Array


def weights(
    draw: Draw, triangle: NDArray[Any], x: NDArray[Any], y: NDArray[Any], size: tuple[int, int], derivatives: bool = True
) -> Weights:
    """The weights at the places x, y (N,) [pixels, row 0 at the top, pixel centres at + 0.5] of the triangles (N,).

    A point q of the picture is where sum(beta_i p_i) is proportional to q in homogeneous coordinates: with the corners moved
    so that q is the origin, beta_i is the cross product of the other two (Olano and Greer 1997). Corners behind the eye are no
    exception. Without `derivatives` dx and dy are empty.
    """
    corners = draw.clip[draw.triangles[triangle]]
    w = corners[..., 3]
    across = 0.5 * size[0] * (corners[..., 0] + w) - x[:, None] * w
    down = 0.5 * size[1] * (corners[..., 1] + w) - y[:, None] * w
    one, other = [1, 2, 0], [2, 0, 1]
    beta = across[:, one] * down[:, other] - across[:, other] * down[:, one]
    total = beta.sum(axis=1)
    # Seen edge on a triangle has no inside, and all places on it are equally right.
    flat = ~(np.abs(total) > 0)
    beta[flat], total[flat] = 1.0, 3.0
    values = beta / total[:, None]
    depth = np.einsum("ij,ij->i", values, corners[..., 2]) / np.einsum("ij,ij->i", values, w)
    none = np.empty((0, 3))
    if not derivatives:
        return Weights(values, none, none, depth)
    dx = w[:, other] * down[:, one] - w[:, one] * down[:, other]
    dy = w[:, one] * across[:, other] - w[:, other] * across[:, one]
    dx, dy = ((d - values * d.sum(axis=1, keepdims=True)) / total[:, None] for d in (dx, dy))
    dx[flat], dy[flat] = 0.0, 0.0
    return Weights(values, dx, dy, depth)


def blend(weight: Array, corners: NDArray[np.floating]) -> Array:
    """(N, C): the mean of the corners' (N, 3, C) values by the weights (N, 3)."""
    result: Array = np.einsum("ij,ijk->ik", weight, corners)
    return result
