"""Albedo: integrates a model over the hemisphere. The result is the share of the light from one direction that it reflects."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, widened

Array = NDArray[np.float64]

# The numbers of Gauss points along a side of a cell. The cell's integral uses ORDER points, and its difference from the
# integral with COARSE points is the estimated error.
ORDER, COARSE = 6, 4
# Cells about the directions where lobes peak are small from the start: the cells around the normal are rings whose heights
# halve RINGS times, and the cells around other peaks are quartered SEEDED times. The smallest cells are narrower than a lobe of
# exponent 1e8, so that a narrow lobe cannot lie unnoticed between the Gauss points.
RINGS, SEEDED = 32, 16
# At most MOST cells are refined in a round, and there are at most ROUNDS rounds: near a kink of the model, refinement would
# never end.
MOST, ROUNDS = 4096, 24


def directional_albedo(brdf: Brdf, v: Any, within: float = 1e-6) -> Array:
    """Returns the directional albedo [1] for each direction v, in float64, as an array of the shape of v.

    The albedo is the integral of f cos over all directions to the light. Here f is the model's value, and cos is the cosine of
    the light's angle from the normal.

    It is the radiance of the surface under a uniform sky of radiance 1. For a reciprocal model it is also the share of
    the light from v that is reflected. The method is adaptive cubature with Gauss's rules over (1 - cos theta, phi).

    brdf: a material without textures.
    v: unit directions to the viewer in the local frame (n = +z): (..., 3), with any leading shape.
    within: the largest estimated absolute error.
    Errors: ValueError for a textured material.
    """
    v = np.asarray(v, dtype=np.float64)
    m = widened(brdf)
    albedos = [_integral(type(brdf), m, direction, within) for direction in v.reshape(-1, 3)]
    return np.array(albedos).reshape(v.shape)


def _integral(model: type[Brdf], m: Any, v: Array, within: float) -> Array:
    """Returns the directional albedo (3,) for one direction v (3,)."""
    if not v[2] > 0:
        return np.zeros(3)
    cells = _seeded(v)
    total = np.zeros(3)
    for round_ in range(ROUNDS):
        fine = _cells(model, m, v, cells, ORDER)
        error = np.abs(fine - _cells(model, m, v, cells, COARSE)).max(axis=1)
        worst = np.argsort(-error)
        # Refine the cells with the largest errors: so many of them that the errors of the other cells add up to `within` or
        # less.
        rest = np.cumsum(error[worst][::-1])[::-1]
        refined = worst[: min(int(np.sum(rest > within)), MOST)]
        if round_ == ROUNDS - 1:
            refined = refined[:0]
        done = np.ones(len(cells), dtype=bool)
        done[refined] = False
        total += fine[done].sum(axis=0)
        if not len(refined):
            break
        cells = _quartered(cells[refined])
    return total


def _seeded(v: Array) -> Array:
    """Returns the hemisphere as cells (C, 4), small ones around the normal, v and the mirror direction of v.

    A cell is (1 - cos theta, phi, height, width): its first corner and its extent in the two coordinates.
    """
    rings = [0.0, *(2.0**-k for k in range(RINGS, -1, -1))]
    width = np.pi / 4
    cells = np.array([(low, j * width, high - low, width) for low, high in pairwise(rings) for j in range(8)])
    s, phi = (v[0] ** 2 + v[1] ** 2) / (1 + v[2]), np.arctan2(v[1], v[0])
    for _ in range(SEEDED):
        near = np.zeros(len(cells), dtype=bool)
        for angle in (phi, phi + np.pi):
            # A cell is also cut if the peak is up to half a cell outside it. So both sides of a border are refined.
            up = np.abs(s - cells[:, 0] - cells[:, 2] / 2) <= cells[:, 2]
            across = np.abs((angle - cells[:, 1] - cells[:, 3] / 2 + np.pi) % (2 * np.pi) - np.pi) <= cells[:, 3]
            near |= up & across
        cells = np.concatenate([cells[~near], _quartered(cells[near])])
    return cells


def _quartered(cells: Array) -> Array:
    """Cuts each of the cells (C, 4) into quarters and returns these, (4 C, 4)."""
    s, phi, height, width = cells.T / [[1], [1], [2], [2]]
    return np.concatenate([np.stack([s + i * height, phi + j * width, height, width], axis=1) for i in (0, 1) for j in (0, 1)])


def _cells(model: type[Brdf], m: Any, v: Array, cells: Array, order: int) -> Array:
    """Returns the integral of f cos over each of the cells (C, 4), (C, 3), with order x order Gauss points a cell."""
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
