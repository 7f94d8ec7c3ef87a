"""Layers: what a smooth dielectric surface lets through, in float64. Indices are of the inside over the outside, at least 1."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def t_dielectric(c: Array, eta: Array) -> Array:
    """(...): 1 - f_dielectric(c, eta) without the subtraction, so that what passes at grazing angles keeps its digits.

    c (...): the cosine outside. Of either polarisation 4 x y/(x + y)^2 passes, with x = c or eta^2 c and y = eta cos(inside).
    """
    c, eta = np.asarray(c), np.asarray(eta)
    y = np.sqrt((eta - 1) * (eta + 1) + c * c)
    # Without a surface (index 1) everything passes, in the horizon (0/0) as well.
    with np.errstate(divide="ignore", invalid="ignore"):
        s, p = (4 * (x / (x + y)) * (y / (x + y)) for x in (c, eta**2 * c))
    result: Array = np.where(eta > 1, 0.5 * (s + p), 1.0)
    return result


def diffuse_fresnel(eta: Array) -> Array:
    """(...): the share of perfectly diffuse light that the surface reflects, the integral of 2 c f_dielectric(c) over [0, 1].

    Of diffuse light from inside, 1 - (1 - this)/eta^2 is reflected, because light takes the same ways out as in.
    Closed form: Walsh 1926; Duntley 1942. Written in z = (eta - 1)/(eta + 1), after its poles at eta = 1 have cancelled.
    """
    eta = np.asarray(eta)
    z = (eta - 1) / (eta + 1)
    q = z * z
    with np.errstate(divide="ignore", invalid="ignore"):
        # (atanh(z)/z - 1)/z^2 = 1/3 + z^2/5 + z^4/7 + ...; below 0.1 by these terms, the last of which is 1e-17.
        small = sum(q**k / (2 * k + 3) for k in range(8))
        rest = np.where(z < 0.1, small, (np.arctanh(z) / z - 1) / q)
        log_z = np.where(z > 0, np.log(np.maximum(z, 1e-37)), 0.0)
    b = -2 + z * (5 + rest) - 2 * q - 4 * z * q + z * q * rest * (5 - 5 * q - q * q) - z * q * q
    result: Array = (
        0.5 + z * (2 + z) / 6 + (1 + z) ** 3 * (1 - z) / (4 * (1 + q) ** 3) * b + 2 * q * (1 + z) ** 2 / (1 + q) ** 3 * log_z
    )
    return result
