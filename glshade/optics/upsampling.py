"""Upsampling: smooth reflectances whose colour under D65 is a given colour (Jakob and Hanika 2019).

A reflectance is s(c0 x^2 + c1 x + c2) with s(t) = 1/2 + t / (2 sqrt(1 + t^2)), where x runs from 0 to 1 over the visible waves.
It lies between 0 and 1 whatever the coefficients, so that a surface of such a colour gains no energy.
"""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from glshade.optics.observer import WAVELENGTHS, daylight, rgb_weights

Array = NDArray[np.float64]

# The waves over which x runs from 0 to 1 [nm], as in the paper. Beyond them the polynomial goes on.
FIRST, LAST = 360.0, 830.0
X: Array = (WAVELENGTHS - FIRST) / (LAST - FIRST)
# The difference of colours at which the search ends, far below the 1e-4 that is asked for.
CLOSE = 1e-10
# The search goes from grey to the colour in this many steps; each starts from the coefficients of the step before it.
STEPS = 24
# The number of Gauss-Newton steps for each of them. Saturated colours need the most, about twenty.
MOST = 60


def spectrum_of(colour: tuple[float, float, float]) -> Array:
    """Returns a spectrum (531,) with a colour under D65: a reflectance if no channel is above 1, else a multiple of one.

    The spectrum of a grey is constant. A colour with negative channels is the difference of two spectra.
    """
    lacking = tuple(max(-c, 0.0) for c in colour)
    given = _positive((max(colour[0], 0.0), max(colour[1], 0.0), max(colour[2], 0.0)))
    return given - _positive((lacking[0], lacking[1], lacking[2])) if any(lacking) else given


@lru_cache(maxsize=4096)
def _positive(colour: tuple[float, float, float]) -> Array:
    """Returns the spectrum (531,) of a colour without negative channels."""
    if colour[0] == colour[1] == colour[2]:
        return np.full(len(WAVELENGTHS), colour[0])
    size = max(*colour, 1.0)
    return size * _reflectance(tuple(c / size for c in colour))


def _reflectance(colour: tuple[float, ...]) -> Array:
    """Returns a reflectance (531,) of a colour whose channels lie between 0 and 1."""
    wanted = np.array(colour)
    # The search starts well inside the range of colours that reflectances have.
    grey = float(np.clip(wanted.mean(), 0.05, 0.95))
    coefficients = np.array([0.0, 0.0, (grey - 0.5) / np.sqrt(grey * (1 - grey))])
    for step in range(1, STEPS + 1):
        coefficients = _fitted(coefficients, grey + (wanted - grey) * step / STEPS)
    return _sigmoid(_polynomials() @ coefficients)


@cache
def _polynomials() -> Array:
    """Returns the powers x^2, x and 1 (531, 3)."""
    return np.stack([X * X, X, np.ones_like(X)], axis=1)


def _sigmoid(t: Array) -> Array:
    result: Array = 0.5 + t / (2 * np.sqrt(1 + t * t))
    return result


def _fitted(coefficients: Array, wanted: Array) -> Array:
    """Returns coefficients (3,) of a reflectance with the colour `wanted` (3,), by Gauss-Newton steps.

    A step that leads away from the colour is halved.
    """
    basis, weights = _polynomials(), daylight()[:, None] * rgb_weights()

    def missed(tried: Array) -> Array:
        return np.asarray(_sigmoid(basis @ tried) @ weights - wanted)

    error = missed(coefficients)
    for _ in range(MOST):
        size = float(np.abs(error).max())
        if size < CLOSE:
            break
        t = basis @ coefficients
        slope = weights.T @ (basis * (0.5 / (1 + t * t) ** 1.5)[:, None])
        step = np.linalg.lstsq(slope, -error, rcond=1e-12)[0]
        for _ in range(20):
            closer = missed(coefficients + step)
            if np.abs(closer).max() < size:
                coefficients, error = coefficients + step, closer
                break
            step = step / 2
        else:
            break
    return coefficients
