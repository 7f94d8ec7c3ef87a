"""Samples: what a file of measured reflectance holds, as directions and values or as cells of a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Float64
from glshade.measured.rusinkiewicz import angles, directions, mirrored
from glshade.measured.table import grid

Axis = Literal["theta_h", "theta_d", "phi_d"]
AXES: tuple[Axis, ...] = ("theta_h", "theta_d", "phi_d")
# Light directions whose azimuths differ by less than this count as one [rad]; files give angles with six digits.
SAME_AZIMUTH = 1e-3


@dataclass(frozen=True, eq=False)
class Samples:
    """Reflectance at single pairs of directions.

    l: (N, 3), unit directions to the light in the local frame, in which z is the normal and x the tangent.
    v: (N, 3), unit directions to the viewer in the same frame.
    f: (N, 3), reflectance in linear Rec. 709 [1/sr]. A channel is negative where a colour lies outside of the gamut.
    axes: the angles that were varied. Where one is left out, the data do not tell how f depends on it, and it has some value.
    retro: whether these angles are those about the back vector; None where the file does not say so.
    notes: sentences about the file, such as what was left out.
    symmetric: whether a value stands for f(v, l) as well, as in a file that has one cell for both.
    """

    l: Float64
    v: Float64
    f: Float64
    axes: tuple[Axis, ...] = AXES
    retro: bool | None = None
    notes: tuple[str, ...] = ()
    symmetric: bool = False

    def __len__(self) -> int:
        return len(self.f)

    @property
    def oriented(self) -> bool:
        """Whether the light comes from several azimuths, as where a surface with a grain is measured."""
        azimuth = np.arctan2(self.l[:, 1], self.l[:, 0])[self.l[:, 2] < 1 - 1e-9]
        turned = np.abs(np.exp(1j * azimuth) - np.exp(1j * azimuth[:1]))
        return bool(np.any(turned > SAME_AZIMUTH))

    def chosen(self, rows: NDArray[Any]) -> Samples:
        """Returns some of the samples. rows: an index for NumPy arrays."""
        return replace(self, l=self.l[rows], v=self.v[rows], f=self.f[rows])

    def about(self, retro: bool) -> tuple[Float64, Float64, Float64]:
        """Returns theta_h, theta_d and phi_d, each (N,) [rad]. retro: whether about the back vector."""
        return angles(mirrored(self.l) if retro else self.l, self.v)


@dataclass(frozen=True, eq=False)
class Grid:
    """Reflectance in the cells of a regular grid over phi_d (from 0 to pi), theta_d and theta_h.

    f: (P, D, H, 3), linear Rec. 709 [1/sr]; NaN in cells that were not measured. Cells as in glshade/measured/table.py.
    notes: sentences about the file.
    """

    f: Float64
    notes: tuple[str, ...] = ()

    def samples(self, most: int, seed: int = 0) -> Samples:
        """Returns the known cells, or a random choice of at most `most` of them."""
        known = np.flatnonzero(~np.isnan(self.f[..., 0]))
        if len(known) > most:
            known = np.sort(np.random.default_rng(seed).choice(known, most, replace=False))
        p, d, h = np.unravel_index(known, self.f.shape[:3])
        theta_h, theta_d, phi_d = grid(self.f.shape[:3], math.pi)
        l, v = lit_from_x(*directions(theta_h[0, 0, h], theta_d[0, d, 0], phi_d[p, 0, 0]))
        return Samples(l, v, self.f[p, d, h], notes=self.notes, symmetric=True)


def lit_from_x(l: Float64, v: Float64) -> tuple[Float64, Float64]:
    """Returns directions l and v (N, 3), both turned about the normal so that the light comes from the azimuth 0."""
    length = np.hypot(l[:, 0], l[:, 1])
    turned = length > 0
    c, s = np.where(turned, l[:, 0], 1.0) / np.where(turned, length, 1.0), l[:, 1] / np.where(turned, length, 1.0)
    x, y, z = v.T
    return np.stack([length, np.zeros_like(length), l[:, 2]], axis=-1), np.stack([c * x + s * y, c * y - s * x, z], axis=-1)


Measurement = Samples | Grid


def points(measurement: Measurement, most: int) -> Samples:
    """Returns a measurement as samples. most: the largest number of cells of a grid that are chosen."""
    return measurement.samples(most) if isinstance(measurement, Grid) else measurement
