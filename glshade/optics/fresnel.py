"""Fresnel: the shares of light that a smooth surface reflects and transmits, in float64.

Function names begin with f for the reflectance and with t for the transmittance, which is 1 - f. The shape (...)
stands for any leading shape, and (..., 3) for that shape with three colour channels. Arguments:
LoH (...): cosine between the light and the normal of the surface or facet, at least 0.
eta, k: the index of refraction eta + i k of the inside divided by that of the outside; (..., 3) for conductors.
f0 (..., 3): the reflectance at normal incidence.
t0 (..., 3): 1 - f0.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def f_schlick(f0: Array, LoH: Array) -> Array:
    """Returns Schlick's approximation of the reflectance (..., 3) (Schlick 1994, eq. 15)."""
    # A rounded unit vector can be longer than 1, and the cosine with it.
    x = np.maximum(1 - np.asarray(LoH), 0)
    result: Array = f0 + (1 - f0) * (x**5)[..., None]
    return result


def t_schlick(t0: Array, LoH: Array) -> Array:
    """Returns Schlick's approximation of the transmittance (..., 3). It is never negative, and no digits cancel."""
    c = np.asarray(LoH)
    # This is 1 - (1 - c)^5 multiplied out.
    risen = c * (5 - c * (10 - c * (10 - c * (5 - c))))
    result: Array = t0 * risen[..., None]
    return result


def f_dielectric(LoH: Array, eta: Array) -> Array:
    """Returns the exact reflectance (...) for unpolarised light and eta (...) >= 1: the mean of the squares of Fresnel's two
    amplitudes.

    With c = LoH and ct the cosine inside, c - eta ct = (1 - eta^2)/(c + eta ct). The other amplitude has a similar form. In
    this form no digits cancel near eta = 1.
    """
    c, eta = np.asarray(LoH), np.asarray(eta)
    sin2 = (1 - c) * (1 + c)
    step = (eta - 1) * (eta + 1)
    # The cosine inside is sqrt(1 - sin^2 / eta^2).
    ct = np.sqrt(step + c * c) / eta
    # An eta of 1 means that there is no surface, so the reflectance is 0. At c = 0 the amplitudes would be 0/0.
    with np.errstate(divide="ignore", invalid="ignore"):
        rs = step / (c + eta * ct) ** 2
        rp = step * (c * c - sin2 / eta**2) / (eta * c + ct) ** 2
    result: Array = np.where(step > 0, 0.5 * (rs * rs + rp * rp), 0.0)
    return result


def f_conductor(eta: Array, k: Array, LoH: Array) -> Array:
    """Returns the exact reflectance (..., 3) for unpolarised light. With k = 0 it is that of a dielectric."""
    c, index2, p = _inside(eta, k, LoH)
    # An index of 1 means that there is no surface, so the reflectance is 0. At c = 0 both amplitudes would be 0/0.
    with np.errstate(divide="ignore", invalid="ignore"):
        rs = np.abs((c - p) / (c + p))
        rp = np.abs((index2 * c - p) / (index2 * c + p))
    result: Array = np.where(index2 == 1, 0.0, 0.5 * (rs * rs + rp * rp))
    return result


def t_conductor(eta: Array, k: Array, LoH: Array) -> Array:
    """Returns the exact transmittance (..., 3), which is never negative.

    1 - f_conductor is rewritten by |x + y|^2 - |x - y|^2 = 4 Re(x y*), which holds for all complex x and y. So no digits
    cancel.
    """
    c, index2, p = _inside(eta, k, LoH)
    with np.errstate(divide="ignore", invalid="ignore"):
        ts = 4 * c * p.real / np.abs(c + p) ** 2
        tp = 4 * c * np.maximum((index2 * p.conj()).real, 0) / np.abs(index2 * c + p) ** 2
    result: Array = np.where(index2 == 1, 1.0, 0.5 * (ts + tp))
    return result


def _inside(eta: Array, k: Array, LoH: Array) -> tuple[Array, NDArray[np.complex128], NDArray[np.complex128]]:
    """Returns the cosine outside, the squared index, and the index times the cosine inside, each (..., 3)."""
    eta, k, c = np.asarray(eta), np.asarray(k), np.asarray(LoH)[..., None]
    # This is index^2 - 1, written so that it keeps its digits where the index is near 1.
    step = (eta - 1) * (eta + 1) - k * k + 2j * eta * k
    return c, (eta + 1j * k) ** 2, np.sqrt(step + c * c)


def f0_conductor(eta: Array, k: Array) -> Array:
    """Returns the reflectance of a conductor at normal incidence (..., 3)."""
    result: Array = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    return result


def t0_conductor(eta: Array, k: Array) -> Array:
    """Returns the transmittance of a conductor at normal incidence (..., 3). Close numbers are not subtracted."""
    result: Array = 4 * eta / ((eta + 1) ** 2 + k**2)
    return result
