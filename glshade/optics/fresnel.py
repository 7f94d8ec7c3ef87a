"""Fresnel: how much light a smooth surface reflects, and lets through, in float64. Indices are of the inside over the outside.

LoH (...): cosine between the light and the (micro)surface's normal, >= 0. Colours are (..., 3).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def f_schlick(f0: Array, LoH: Array) -> Array:
    """(..., 3): Schlick 1994, eq. 15. A choice of model, not a form of the exact Fresnel."""
    # Rounded unit vectors may be longer than 1.
    x = np.maximum(1 - np.asarray(LoH), 0)
    result: Array = f0 + (1 - f0) * (x**5)[..., None]
    return result


def t_schlick(t0: Array, LoH: Array) -> Array:
    """(..., 3): 1 - f_schlick without the subtraction, never negative. t0 = 1 - f0."""
    c = np.asarray(LoH)
    # 1 - (1 - c)^5, multiplied out.
    risen = c * (5 - c * (10 - c * (10 - c * (5 - c))))
    result: Array = t0 * risen[..., None]
    return result


def f_dielectric(LoH: Array, eta: Array) -> Array:
    """(...): exact, for unpolarised light and eta >= 1. The mean of the squares of Fresnel's two amplitudes.

    With ct the cosine inside, c - eta ct = (1 - eta^2)/(c + eta ct), and the like for the other amplitude: nothing cancels
    near eta = 1.
    """
    c, eta = np.asarray(LoH), np.asarray(eta)
    sin2 = (1 - c) * (1 + c)
    step = (eta - 1) * (eta + 1)
    # sqrt(1 - sin^2 / eta^2)
    ct = np.sqrt(step + c * c) / eta
    # At eta = 1 and c = 0 there is no surface, and 0/0.
    with np.errstate(divide="ignore", invalid="ignore"):
        rs = step / (c + eta * ct) ** 2
        rp = step * (c * c - sin2 / eta**2) / (eta * c + ct) ** 2
    result: Array = np.where(step > 0, 0.5 * (rs * rs + rp * rp), 0.0)
    return result


def f_conductor(eta: Array, k: Array, LoH: Array) -> Array:
    """(..., 3): exact, for unpolarised light and the index eta + i k. k = 0 gives the dielectric."""
    c, index2, p = _inside(eta, k, LoH)
    # Without a surface (index 1) both amplitudes are 0/0 at c = 0.
    with np.errstate(divide="ignore", invalid="ignore"):
        rs = np.abs((c - p) / (c + p))
        rp = np.abs((index2 * c - p) / (index2 * c + p))
    result: Array = np.where(index2 == 1, 0.0, 0.5 * (rs * rs + rp * rp))
    return result


def t_conductor(eta: Array, k: Array, LoH: Array) -> Array:
    """(..., 3): 1 - f_conductor without the subtraction, never negative: |x + y|^2 - |x - y|^2 = 4 Re(x y*)."""
    c, index2, p = _inside(eta, k, LoH)
    with np.errstate(divide="ignore", invalid="ignore"):
        ts = 4 * c * p.real / np.abs(c + p) ** 2
        tp = 4 * c * np.maximum((index2 * p.conj()).real, 0) / np.abs(index2 * c + p) ** 2
    result: Array = np.where(index2 == 1, 1.0, 0.5 * (ts + tp))
    return result


def _inside(eta: Array, k: Array, LoH: Array) -> tuple[Array, NDArray[np.complex128], NDArray[np.complex128]]:
    """c, the squared index, and index times the cosine inside, each (..., 3)."""
    eta, k, c = np.asarray(eta), np.asarray(k), np.asarray(LoH)[..., None]
    # index^2 - 1, which an index near 1 needs to its last digit.
    step = (eta - 1) * (eta + 1) - k * k + 2j * eta * k
    return c, (eta + 1j * k) ** 2, np.sqrt(step + c * c)


def f0_conductor(eta: Array, k: Array) -> Array:
    """(..., 3): of a conductor at normal incidence."""
    result: Array = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    return result


def t0_conductor(eta: Array, k: Array) -> Array:
    """(..., 3): 1 - f0_conductor without the subtraction."""
    result: Array = 4 * eta / ((eta + 1) ** 2 + k**2)
    return result
