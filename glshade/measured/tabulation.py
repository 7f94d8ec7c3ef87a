"""Tabulation: from what a file holds to the table that is drawn."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Float64
from glshade.measured.samples import SAME_AZIMUTH, Grid, Measurement, Samples
from glshade.measured.scattered import NOISE, Scattered, places_of, without_dropouts
from glshade.measured.table import (
    BRIGHTEST,
    DARKEST,
    Table,
    completed,
    coordinates,
    encoded,
    grid,
)

Reciprocity = Literal["kept", "enforced"]
# The size of a table of scattered samples, along phi_d, theta_d and theta_h. A reflector that sends light back to its source
# has a peak at theta_d = 0, half as wide in theta_d as in the viewer's angle.
SCATTERED_SIZE = (60, 360, 90)
# The splines are evaluated in each of the first DENSE rows of theta_d and in every COARSE_D-th row beyond; between these the
# table is linear. A spline costs much more than a cell.
DENSE, COARSE_D = 24, 12
# The number of iterations of the solver that makes the table pass through the samples. After these, the table is within 0.1 %
# of most samples.
ROUNDS = 20


# A surface has a grain where more than a tenth of the samples differ by more than this share from samples whose light comes
# from other azimuths but which are alike otherwise. The share is small, because most samples lie outside of the highlight,
# where a grain cannot be seen.
GRAIN = 0.25
# Samples are alike where their places (glshade/measured/scattered.py) differ by less than this [rad].
ALIKE = 0.02


def is_grained(samples: Samples) -> bool:
    """Returns whether f clearly depends on the azimuth of the surface, as brushed metal's or satin's does."""
    if not samples.oriented or "phi_d" not in samples.axes:
        return False
    from scipy.spatial import cKDTree

    places = places_of(*samples.about(False), samples.axes)
    azimuth = np.exp(1j * np.arctan2(samples.l[:, 1], samples.l[:, 0]))
    logarithms = np.log(np.maximum(samples.f.max(axis=1), NOISE * samples.f.max()))
    # Sixteen azimuths are the most that a goniometer's file usually has for one pair of angles.
    distance, near = cKDTree(places).query(places, min(16, len(places)), distance_upper_bound=ALIKE)
    rows, columns = np.nonzero(np.isfinite(distance))
    first, second = rows, near[rows, columns]
    turned = np.abs(azimuth[first] - azimuth[second]) > SAME_AZIMUTH
    if not turned.any():
        return False
    return bool(np.quantile(np.abs(logarithms[first] - logarithms[second])[turned], 0.9) > GRAIN)


def tabulated(measurement: Measurement, reciprocity: Reciprocity = "kept", digest: str = "") -> Table:
    """Returns the table of a measurement of a surface without a grain.

    reciprocity: "enforced" takes the mean of f(l, v) and f(v, l), as geometric mean; "kept" keeps the difference.
    digest: the table's digest.
    """
    if isinstance(measurement, Grid):
        below = "Cells below the horizon and cells that were not measured continue the cells beside them."
        return Table(completed(encoded(measurement.f)), math.pi, False, digest, (*measurement.notes, below))
    measurement = without_dropouts(measurement)
    scattered = Scattered(measurement)
    complete = "phi_d" in measurement.axes
    turn = 2 * math.pi if complete else math.pi
    size = SCATTERED_SIZE if complete else _reduced_size(measurement)
    logarithms = _interpolated(scattered, size, turn)
    _draw_through(logarithms, turn, scattered, measurement)
    if complete and scattered.one_sided:
        # The solver's rounding has made the two sides differ a little.
        logarithms = (logarithms + logarithms[::-1]) / 2
    if complete and reciprocity == "enforced":
        half = size[0] // 2
        logarithms, turn = (logarithms[:half] + logarithms[half:]) / 2, math.pi
    values = np.ascontiguousarray(np.clip(logarithms, DARKEST, BRIGHTEST).astype(np.float16))
    return Table(values, turn, scattered.retro, digest, (*measurement.notes, *_notes(scattered, measurement)))


def _reduced_size(samples: Samples) -> tuple[int, int, int]:
    """Returns the size of a table of samples that do not say how f depends on some of the angles: one cell along those."""
    return (1, *(count if axis in samples.axes else 1 for axis, count in (("theta_d", 180), ("theta_h", 180))))  # type: ignore[return-value]


def _interpolated(scattered: Scattered, size: tuple[int, int, int], turn: float) -> Float64:
    """Returns the binary logarithms (P, D, H, 3) between scattered samples. Cells below the horizon hold the last angle's."""
    theta_h, theta_d, phi_d = grid(size, turn)
    layers = size[0] // 2 if scattered.one_sided and size[0] > 1 else size[0]
    rows = np.union1d(np.arange(min(DENSE, size[1])), np.arange(0, size[1], COARSE_D))
    rows = np.union1d(rows, [size[1] - 1])
    found = np.empty((layers, len(rows), size[2], 3))
    # One layer at a time, so that the neighbours of all nodes do not fill the memory.
    for layer in range(layers):
        nodes = np.broadcast_arrays(theta_h[0], theta_d[0, rows], phi_d[layer])
        found[layer] = encoded(scattered.at(*(node.ravel() for node in nodes))).reshape(found[layer].shape)
    found = _between(found, rows, size[1])
    return np.ascontiguousarray(np.concatenate([found, found[::-1]]) if layers < size[0] else found)


def _between(values: Float64, rows: NDArray[Any], count: int) -> Float64:
    """Returns values in all of `count` rows of theta_d, linear between those (P, R, H, 3) in some rows (R,)."""
    if len(rows) == count:
        return values
    from scipy.interpolate import interp1d

    result: Float64 = interp1d(rows, values, axis=1, assume_sorted=True)(np.arange(count))
    return result


def _draw_through(logarithms: Float64, turn: float, scattered: Scattered, samples: Samples) -> None:
    """Changes the cells (P, D, H, 3) by the least amount with which the table goes through the samples, where it can."""
    from scipy.sparse.linalg import lsqr

    l, v, f = samples.l, samples.v, samples.f
    if scattered.one_sided and "phi_d" in samples.axes:
        side = np.array([1.0, -1.0, 1.0])
        l, v, f = np.concatenate([l, l * side]), np.concatenate([v, v * side]), np.concatenate([f, f])
    size = logarithms.shape[:3]
    at = coordinates(*Samples(l, v, f).about(scattered.retro), turn)
    weights = trilinear_weights(at, size)
    cells = logarithms.reshape(-1, 3)
    cells[:] = cells[_shared(size)]
    missing = encoded(np.maximum(f, 0.0)) - weights @ cells
    touched = weights.astype(bool).astype(np.float64)
    for channel in range(3):
        change = lsqr(weights, missing[:, channel], iter_lim=ROUNDS)[0]
        # No cell moves by more than twice of what the table misses at a sample beside it: samples that disagree make no spikes.
        most = touched.multiply(np.abs(missing[:, channel])[:, None]).max(axis=0).toarray().ravel()
        cells[:, channel] += np.clip(change, -2 * most, 2 * most)[_shared(size)]


def trilinear_weights(at: Float64, size: tuple[int, ...]) -> Any:
    """Returns the sparse matrix (N, cells) of the weights with which cells make the value at texture coordinates (N, 3).

    The cells of a table at whose border phi_d has no meaning count as one. size: the table's size P, D, H.
    """
    from scipy.sparse import csr_matrix

    counts = np.array(size[::-1])
    place = at * counts - 0.5
    first = np.floor(place)
    share = place - first
    shared = _shared(size)
    columns, weights = [], []
    for corner in np.ndindex(2, 2, 2):
        cell = (first + corner).astype(np.intp)
        h, d = np.clip(cell[:, 0], 0, counts[0] - 1), np.clip(cell[:, 1], 0, counts[1] - 1)
        columns.append(shared[(cell[:, 2] % counts[2] * counts[1] + d) * counts[0] + h])
        weights.append(np.prod(np.where(corner, share, 1 - share), axis=1))
    rows = np.tile(np.arange(len(at)), 8)
    return csr_matrix((np.concatenate(weights), (rows, np.concatenate(columns))), (len(at), int(np.prod(size))))


def _shared(size: tuple[int, ...]) -> NDArray[np.intp]:
    """Returns, for each cell, the index of the cell whose value it has: the first rows of theta_d and theta_h have one value
    for all phi_d."""
    index = np.arange(int(np.prod(size))).reshape(size)
    index[:, 0] = index[:1, 0]
    index[:, :, 0] = index[:1, :, 0]
    return index.ravel()


def _notes(scattered: Scattered, samples: Samples) -> tuple[str, ...]:
    """Returns sentences that say what the table holds where nothing was measured."""
    light, viewer = (f"{np.degrees(angle):.4g}" for angle in scattered.largest)
    about = "back" if scattered.retro else "half"
    if "phi_d" not in samples.axes:
        varied = " and ".join(samples.axes)
        return (f"The file varies {varied} about the {about} vector alone; f is the same for all other angles.",)
    return (
        f"Measured up to {light} degrees from the normal for the light, {viewer} for the viewer; beyond, the last angle holds.",
        f"The table is one about the {about} vector.",
        *(("One side of the plane of incidence was measured; the other one mirrors it.",) if scattered.one_sided else ()),
    )
