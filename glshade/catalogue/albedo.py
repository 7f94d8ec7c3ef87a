"""Albedo: how much of the light from one direction a model gives back in all, by integrating it over the hemisphere."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, widened

Array = NDArray[np.float64]

# Points a side of a cell. The 4 x 4 Gauss rule beside the 6 x 6 one says how far a cell is off.
ORDER, COARSE = 6, 4
# Cells about the directions where lobes have their peaks are cut this often before anything is looked at, those at the normal
# in rings, the others in four: the smallest are narrower than a lobe of exponent 1e8.
RINGS, SEEDED = 32, 16
# No more cells than this in one round of refinement, and no more rounds: a kink costs cells without end.
MOST, ROUNDS = 4096, 24


def albedo(brdf: Brdf, v: Any, within: float = 1e-6) -> Array:
    """Directional albedo, (..., 3): the integral of f cos over all directions to the light, in float64.

    v (..., 3): unit directions to the viewer in the local frame (n = +z). By reciprocity it is also the share that leaves of
    light from there; of a model that is not reciprocal it is the radiance under a uniform white sky. within: the estimated
    error, absolute. Adaptive cubature of Gauss's rules over (1 - cos theta, phi). Errors: ValueError for a textured material.
    """
    v = np.asarray(v, dtype=np.float64)
    m = widened(brdf)
    found = [_integral(type(brdf), m, one, within) for one in v.reshape(-1, 3)]
    return np.array(found).reshape(v.shape)


def _integral(model: type[Brdf], m: Any, v: Array, within: float) -> Array:
    if not v[2] > 0:
        return np.zeros(3)
    # Cells as (1 - cos theta, phi, height, width) of their first corner and extent.
    cells = _seeded(v)
    total = np.zeros(3)
    for round_ in range(ROUNDS):
        fine = _cells(model, m, v, cells, ORDER)
        error = np.abs(fine - _cells(model, m, v, cells, COARSE)).max(axis=1)
        worst = np.argsort(-error)
        # What is left, summed from the smallest, is good enough.
        rest = np.cumsum(error[worst][::-1])[::-1]
        bad = worst[: min(int(np.sum(rest > within)), MOST)]
        if round_ == ROUNDS - 1:
            bad = bad[:0]
        good = np.ones(len(cells), dtype=bool)
        good[bad] = False
        total += fine[good].sum(axis=0)
        if not len(bad):
            break
        cells = _quartered(cells[bad])
    return total


def _seeded(v: Array) -> Array:
    """The hemisphere in cells, small about the mirror direction of v, v itself and the normal."""
    rings = [0.0, *(2.0**-k for k in range(RINGS, -1, -1))]
    width = np.pi / 4
    cells = np.array([(low, j * width, high - low, width) for low, high in pairwise(rings) for j in range(8)])
    s, phi = (v[0] ** 2 + v[1] ** 2) / (1 + v[2]), np.arctan2(v[1], v[0])
    for _ in range(SEEDED):
        near = np.zeros(len(cells), dtype=bool)
        for angle in (phi, phi + np.pi):
            # Half a cell to every side, so that a peak on a border is seen from both.
            up = np.abs(s - cells[:, 0] - cells[:, 2] / 2) <= cells[:, 2]
            across = np.abs((angle - cells[:, 1] - cells[:, 3] / 2 + np.pi) % (2 * np.pi) - np.pi) <= cells[:, 3]
            near |= up & across
        cells = np.concatenate([cells[~near], _quartered(cells[near])])
    return cells


def _quartered(cells: Array) -> Array:
    s, phi, height, width = cells.T / [[1], [1], [2], [2]]
    return np.concatenate([np.stack([s + i * height, phi + j * width, height, width], axis=1) for i in (0, 1) for j in (0, 1)])


def _cells(model: type[Brdf], m: Any, v: Array, cells: Array, order: int) -> Array:
    """(C, 3): the integral over each cell."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    nodes, weights = (nodes + 1) / 2, weights / 2
    s = (cells[:, 0, None] + cells[:, 2, None] * nodes)[:, :, None]
    phi = (cells[:, 1, None] + cells[:, 3, None] * nodes)[:, None, :]
    r = np.sqrt(s * (2 - s))
    l = np.stack(np.broadcast_arrays(r * np.cos(phi), r * np.sin(phi), 1 - s), axis=-1)
    value = model.brdf_cos(m, l.reshape(-1, 3), np.broadcast_to(v, (l.size // 3, 3)))
    value = np.broadcast_to(value, (l.size // 3, 3)).reshape(*l.shape)
    result: Array = np.einsum("cijk,i,j->ck", value, weights, weights) * (cells[:, 2] * cells[:, 3])[:, None]
    return result
