"""Interface: the light that a smooth dielectric surface transmits and reflects, in float64.

The shape (...) stands for any leading shape.
eta (...): the index of refraction of the inside divided by that of the outside, at least 1.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def t_dielectric(c: Array, eta: Array) -> Array:
    """Returns the transmittance (...), which is 1 - f_dielectric(c, eta). Nothing is subtracted, so that it keeps its digits at
    grazing angles.

    c (...): the cosine between the light and the normal, outside. The transmittance of a polarisation is 4 x y/(x + y)^2, with
    x = c for one and x = eta^2 c for the other, and y = eta times the cosine inside.
    """
    c, eta = np.asarray(c), np.asarray(eta)
    y = np.sqrt((eta - 1) * (eta + 1) + c * c)
    # An index of 1 means that there is no surface, so the transmittance is 1, also at c = 0, where the formula is 0/0.
    with np.errstate(divide="ignore", invalid="ignore"):
        s, p = (4 * (x / (x + y)) * (y / (x + y)) for x in (c, eta**2 * c))
    result: Array = np.where(eta > 1, 0.5 * (s + p), 1.0)
    return result


def diffuse_fresnel(eta: Array) -> Array:
    """Returns the share (...) of diffuse light from outside that the surface reflects.

    It is the integral of 2 c f_dielectric(c) over [0, 1].

    If F is this share, the surface reflects 1 - (1 - F)/eta^2 of diffuse light from inside, because light paths are reversible.
    The closed form is by Walsh 1926 and Duntley 1942. Here it is written in z = (eta - 1)/(eta + 1), so that its poles at eta =
    1 cancel.
    """
    eta = np.asarray(eta)
    z = (eta - 1) / (eta + 1)
    q = z * z
    with np.errstate(divide="ignore", invalid="ignore"):
        # (atanh(z)/z - 1)/z^2 = 1/3 + z^2/5 + z^4/7 + ... Below z = 0.1 these eight terms are exact to 1e-17.
        small = sum(q**k / (2 * k + 3) for k in range(8))
        rest = np.where(z < 0.1, small, (np.arctanh(z) / z - 1) / q)
        log_z = np.where(z > 0, np.log(np.maximum(z, 1e-37)), 0.0)
    b = -2 + z * (5 + rest) - 2 * q - 4 * z * q + z * q * rest * (5 - 5 * q - q * q) - z * q * q
    result: Array = (
        0.5 + z * (2 + z) / 6 + (1 + z) ** 3 * (1 - z) / (4 * (1 + q) ** 3) * b + 2 * q * (1 + z) ** 2 / (1 + q) ** 3 * log_z
    )
    return result
