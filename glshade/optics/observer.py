"""Observer: the colours of spectra, as the CIE 1931 2-degree standard observer sees them, in linear Rec. 709.

A spectrum is an array with a value for each of WAVELENGTHS. Integrals over the wavelength are sums over these steps of 1 nm.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The steps of all integrals [nm]. The observer sees light from 360 nm on; fluorescent dyes are excited by shorter waves too.
# The published tables of illuminants begin at 300 nm and end at 830 nm at the latest.
WAVELENGTHS: Array = np.arange(300.0, 831.0)
TABLES = Path(__file__).parent / "tables"
# The chromaticities x, y of the primaries of ITU-R BT.709.
PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
# The cone responses of Bradford's chromatic adaptation, from XYZ (Lam 1985).
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


@cache
def table(name: str) -> Array:
    """Returns a table (N, K) of the folder `tables`: the first column holds wavelengths [nm], the others values."""
    return np.loadtxt(TABLES / f"{name}.csv", delimiter=",", encoding="utf-8")


def sampled(wavelengths: Array, values: Array, held: bool = False) -> Array:
    """Returns the spectrum (531,) of a table that is linear between its rows.

    wavelengths: the wavelengths (N,) of the rows, ascending [nm].
    values: their values (N,).
    held: whether the first and the last value hold beyond the table's ends; otherwise the spectrum is 0 there.
    """
    return np.interp(WAVELENGTHS, wavelengths, values, *(() if held else (0.0, 0.0)))


@cache
def matching() -> Array:
    """Returns the colour-matching functions (531, 3) of the observer, x, y and z."""
    wavelengths, *columns = table("observer").T
    return np.stack([sampled(wavelengths, column) for column in columns], axis=1)


@cache
def daylight() -> Array:
    """Returns the spectrum (531,) of the illuminant D65 with luminance 1."""
    spectrum = sampled(*table("D65").T)
    return spectrum / (spectrum @ matching()[:, 1])


@cache
def rgb_weights() -> Array:
    """Returns the weights (531, 3) that turn a spectrum into its colour: spectrum @ weights.

    D65 with luminance 1 has the colour (1, 1, 1).
    """
    primaries = np.array([(x / y, 1.0, (1 - x - y) / y) for x, y in PRIMARIES]).T
    # The columns are scaled so that equal parts of the three primaries have the colour of D65.
    rgb_to_xyz = primaries * np.linalg.solve(primaries, daylight() @ matching())
    return np.linalg.solve(rgb_to_xyz, matching().T).T


def weights_for(white: Array) -> Array:
    """Returns weights (531, 3) as `rgb_weights`, with which a light of this spectrum (531,) and luminance 1 has the colour
    (1, 1, 1). Other colours are adapted to that white as Bradford's method does it.
    """
    seen, wanted = (BRADFORD @ (spectrum @ matching()) for spectrum in (white / (white @ matching()[:, 1]), daylight()))
    adapted = np.linalg.solve(BRADFORD, (wanted / seen)[:, None] * BRADFORD)
    xyz_to_rgb = np.linalg.lstsq(matching(), rgb_weights(), rcond=None)[0]
    return matching() @ adapted.T @ xyz_to_rgb


def reflected(wavelengths: Array, values: Array) -> Array:
    """Returns the colours (..., 3) of reflectances under D65; a reflectance of 1 is (1, 1, 1).

    wavelengths: (N,) ascending [nm].
    values: the reflectances (..., N), which are linear between the wavelengths and 0 beyond them.
    """
    # Each of the N values counts with the weight of its part of the piecewise linear spectrum.
    parts = np.stack([sampled(wavelengths, unit) for unit in np.eye(len(wavelengths))])
    return np.asarray(values) @ (parts @ (daylight()[:, None] * rgb_weights()))
