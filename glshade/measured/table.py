"""Table: reflectance on the grid of the MERL database, from which both renderers draw.

The grid has cells over the square root of theta_h, over theta_d and over phi_d (glshade/measured/rusinkiewicz.py). A cell holds
the binary logarithm of f for red, green and blue, as half floats; between the centres of cells the logarithms are interpolated
trilinearly. Highlights fall off like an exponential or a power, so logarithms need far fewer cells than f itself for the same
error, and they fit into half floats, in which f of a sharp highlight would overflow.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Array, Float64
from glshade.measured.rusinkiewicz import angles, directions, mirrored
from glshade.textures.volume import Volume

# The number of cells along phi_d, theta_d and theta_h in a file of the MERL database (Matusik et al. 2003).
MERL_SIZE = (180, 90, 90)
# The binary logarithms that a table may hold. f below 2^-24 per steradian counts as that: it is a white surface's divided by
# five million. f above 2^15 is that of a highlight narrower than a tenth of a degree.
DARKEST, BRIGHTEST = -24.0, 15.0
# A channel that is darker than this share of the brightest one counts as this share. Without a limit, a colour at the border of
# the gamut would have logarithms that jump from cell to cell; and the share is invisible in a picture of 8 bits.
PALEST = 2.0**-12
# Beyond the horizon, f goes on as it changed between the last cells above it, for this number of cells, and then stays.
CONTINUED = 2


@dataclass(frozen=True, eq=False)
class Table:
    """Reflectance that depends on theta_h, theta_d and phi_d alone.

    values: (P, D, H, 3) float16, the binary logarithms of f [1/sr] at the centres of the cells along phi_d, theta_d, theta_h.
    turn: the period of phi_d [rad]: pi where f(l, v) = f(v, l), else 2 pi.
    retro: whether the angles are those about the back vector: l is replaced by its mirror direction first.
    digest: a text that differs between different tables.
    notes: sentences that say where the table goes on beyond what was measured.
    """

    values: NDArray[np.float16]
    turn: float
    retro: bool
    digest: str
    notes: tuple[str, ...] = ()

    def volume(self) -> Volume:
        """Returns the values as a texture whose width is theta_h, whose height is theta_d and whose depth is phi_d."""
        return Volume(self.values, ("clamp", "clamp", "repeat"), self.digest)

    def at(self, l: Array, v: Array) -> Float64:
        """Returns f (..., 3) [1/sr] in float64 for unit directions l and v (..., 3) above the horizon, which are local."""
        theta_h, theta_d, phi_d = angles(mirrored(l) if self.retro else l, v)
        return np.exp2(self.volume().sample(coordinates(theta_h, theta_d, phi_d, self.turn)))


def coordinates(theta_h: Array, theta_d: Array, phi_d: Array, turn: float) -> Float64:
    """Returns the texture coordinates (..., 3) of angles (...) [rad]: from 0 to 1 they span the table."""
    return np.stack([np.sqrt(theta_h / (math.pi / 2)), theta_d / (math.pi / 2), phi_d / turn], axis=-1)


def cell_angles(size: tuple[int, int, int], turn: float) -> tuple[Float64, Float64, Float64]:
    """Returns theta_h (H,), theta_d (D,) and phi_d (P,) at the centres of the cells [rad].

    size: the number of cells P, D, H along phi_d, theta_d and theta_h.
    turn: the period of phi_d [rad].
    """
    p, d, h = ((np.arange(count) + 0.5) / count for count in size)
    return math.pi / 2 * h * h, math.pi / 2 * d, turn * p


def grid(size: tuple[int, int, int], turn: float) -> tuple[Float64, Float64, Float64]:
    """Returns theta_h, theta_d and phi_d of all cells [rad], as arrays that broadcast to (P, D, H). For the arguments see
    `cell_angles`."""
    theta_h, theta_d, phi_d = cell_angles(size, turn)
    return theta_h[None, None, :], theta_d[None, :, None], phi_d[:, None, None]


def above_horizon(theta_h: Array, theta_d: Array, phi_d: Array) -> NDArray[np.bool_]:
    """Returns whether both directions with these angles (...) [rad] are above the horizon."""
    lower = np.cos(theta_d) * np.cos(theta_h) - np.abs(np.cos(phi_d)) * np.sin(theta_d) * np.sin(theta_h)
    return np.asarray(lower > 1e-9)


def of_function(
    f: Callable[[Float64, Float64], Array],
    turn: float = math.pi,
    size: tuple[int, int, int] = MERL_SIZE,
    retro: bool = False,
    digest: str = "",
    notes: tuple[str, ...] = (),
) -> Table:
    """Returns the table of a function.

    f: takes unit directions l and v (N, 3) above the horizon and returns the reflectance (N, 3) [1/sr], not multiplied by a
        cosine; NaN where it is unknown.
    turn, retro, digest, notes: as for Table.
    size: the number of cells along phi_d, theta_d and theta_h.
    """
    theta_h, theta_d, phi_d = np.broadcast_arrays(*grid(size, turn))
    logarithms = np.full((*size, 3), np.nan)
    # One layer at a time, so that the directions of a fine table do not fill the memory.
    for layer in range(size[0]):
        above = above_horizon(theta_h[layer], theta_d[layer], phi_d[layer])
        l, v = directions(theta_h[layer][above], theta_d[layer][above], phi_d[layer][above])
        logarithms[layer][above] = encoded(f(mirrored(l) if retro else l, v))
    return Table(completed(logarithms), turn, retro, digest, notes)


def encoded(f: Array) -> Float64:
    """Returns the binary logarithms (..., 3) of reflectances (..., 3) [1/sr] within the limits of a table; NaN stays NaN."""
    floor = np.maximum(PALEST * f.max(axis=-1, keepdims=True), 2.0**DARKEST)
    result: Float64 = np.log2(np.minimum(np.maximum(f, floor), 2.0**BRIGHTEST))
    return result


def completed(logarithms: Float64) -> NDArray[np.float16]:
    """Returns the values of a table: every cell is filled, and where phi_d has no meaning, they do not depend on it.

    logarithms: (P, D, H, 3) binary logarithms, NaN in cells that are unknown or below the horizon. It is changed.
    """
    _continue_along_theta_h(logarithms)
    _fill_from_nearest(logarithms)
    # h = n lies at the border of the first cell of theta_h, and l = v at that of theta_d.
    logarithms[:, :, 0] = logarithms[:, :, 0].mean(axis=0)
    logarithms[:, 0] = logarithms[:, 0].mean(axis=0)
    return np.ascontiguousarray(np.clip(logarithms, DARKEST, BRIGHTEST).astype(np.float16))


def _continue_along_theta_h(logarithms: Float64) -> None:
    """Fills the cells (P, D, H, 3) behind the last known one of each row along theta_h, which lie below the horizon."""
    known = np.asarray(~np.isnan(logarithms[..., 0]))
    count = known.shape[2]
    last = count - 1 - np.argmax(known[:, :, ::-1], axis=2)
    rows = np.ix_(np.arange(known.shape[0]), np.arange(known.shape[1]))
    before = np.maximum(last - 1, 0)
    end = logarithms[(*rows, last)]
    slope = end - logarithms[(*rows, before)]
    slope[~np.isfinite(slope)] = 0
    steps = np.arange(count) - last[..., None]
    p, d, h = np.nonzero(known.any(axis=2, keepdims=True) & (steps > 0))
    logarithms[p, d, h] = end[p, d] + slope[p, d] * np.minimum(steps[p, d, h], CONTINUED)[:, None]


def _fill_from_nearest(logarithms: Float64) -> None:
    """Fills the unknown cells (P, D, H, 3) that are left with the nearest known cell's value; without one, all are black."""
    unknown = np.isnan(logarithms[..., 0])
    if unknown.all():
        logarithms[...] = DARKEST
    elif unknown.any():
        from scipy.ndimage import distance_transform_edt

        nearest = distance_transform_edt(unknown, return_distances=False, return_indices=True)
        logarithms[unknown] = logarithms[tuple(nearest[:, unknown])]
