"""Microfacets: distributions of facets, and how facets shadow each other, in float64.

The shape (...) stands for any leading shape.
l, v, h (..., 3): unit vectors to the light, to the viewer, and half-way between, in the local frame, in which z is the normal
and x the tangent.
"""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# A smaller roughness counts as this one. A perfect mirror would show no point light, and its lobe would be infinitely high.
# A texture with black texels would ask for a perfect mirror.
LEAST_ROUGHNESS = 0.01


def alpha(roughness: Array) -> Array:
    """Returns the width of a distribution (...), the square of the roughness, so that equal steps of roughness look equal
    (Burley 2012, section 5.4)."""
    result: Array = np.maximum(roughness, LEAST_ROUGHNESS) ** 2
    return result


def alphas(roughness: Array, anisotropy: Array | float) -> tuple[Array, Array]:
    """Returns the widths of a distribution along x and y (...), for an anisotropy in [0, 1] (Burley 2012, section 5.4)."""
    a, aspect = alpha(roughness), (1 - 0.9 * anisotropy) ** 0.5
    return a / aspect, a * aspect


def ggx_cos(l: Array, v: Array, h: Array, roughness: Array, anisotropy: Array | float = 0.0) -> Array:
    """Returns D V n.l (...) [1/sr], which is finite above the horizon. D is the distribution GGX, V is G2 / (4 n.l n.v), and G2
    is Smith's height-correlated shadowing.

    Walter et al. 2007, eq. 33; Burley 2012, eq. 13; Heitz 2014, eq. 99.
    """
    ax, ay = alphas(roughness, anisotropy)
    slope2 = (h[..., 0] / ax) ** 2 + (h[..., 1] / ay) ** 2 + h[..., 2] ** 2

    def stretched(d: Array) -> Array:
        length: Array = np.sqrt((ax * d[..., 0]) ** 2 + (ay * d[..., 1]) ** 2 + d[..., 2] ** 2)
        return length

    NoL, NoV = l[..., 2], v[..., 2]
    # slope2 is 0 where there is no half vector, and the caller ignores the value there.
    below = 2 * (NoL * stretched(v) + NoV * stretched(l)) * math.pi * ax * ay * slope2**2
    result: Array = NoL / np.maximum(below, 1e-30)
    return result


def d_beckmann(h: Array, a: Array) -> Array:
    """Returns Beckmann's distribution D (...) [1/sr] of width a (...).

    Beckmann and Spizzichino 1963; Walter et al. 2007, eq. 25.
    """
    sin2 = h[..., 0] ** 2 + h[..., 1] ** 2
    # For every width a up to 1 the exponential is 0 where cos2 is below 1e-8.
    cos2 = np.maximum(h[..., 2] ** 2, 1e-8)
    result: Array = np.exp(-sin2 / (a * a * cos2)) / (math.pi * a * a * cos2 * cos2)
    return result


_erfc = np.vectorize(math.erfc, otypes=[np.float64])


def ierfc(x: Array) -> Array:
    """Returns the integral of erfc from x (...) to infinity, exp(-x^2)/sqrt(pi) - x erfc(x) (...).

    Its error is 1e-16. From x = 27 on the result is 0.
    """
    x = np.minimum(x, 27.0)
    result: Array = np.maximum(np.exp(-x * x) / math.sqrt(math.pi) - x * _erfc(x), 0.0)
    return result


def smith_beckmann(l: Array, v: Array, a: Array) -> Array:
    """Returns G2/(4 n.v) (...), where G2 is Smith's height-correlated shadowing for Beckmann's distribution of width a (...).

    G2 = 1/(1 + Lambda(l) + Lambda(v)) with Lambda = (erf(x) - 1)/2 + exp(-x^2)/(2 x sqrt(pi)) = ierfc(x)/(2 x) and
    x = cos/(a sin) of the angle to the normal (Smith 1967; Heitz 2014, eq. 99). A direction below the horizon counts as in the
    horizon.
    """
    NoL, NoV = np.maximum(l[..., 2], 0), np.maximum(v[..., 2], 0)

    def hidden(d: Array) -> Array:
        """Returns n.d Lambda(d) (...), which is finite in the horizon, where Lambda is not."""
        spread = a * np.sqrt(d[..., 0] ** 2 + d[..., 1] ** 2)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = np.where(spread > 0, np.maximum(d[..., 2], 0) / spread, np.inf)
        result: Array = spread / 2 * ierfc(x)
        return result

    result: Array = NoL / np.maximum(4 * (NoL * NoV + NoL * hidden(v) + NoV * hidden(l)), 1e-150)
    return result


def v_groove(l: Array, v: Array, h: Array) -> Array:
    """Returns G/(4 n.v) (...), where G = min(1, 2 (n.h)(n.v)/(v.h), 2 (n.h)(n.l)/(v.h)) is the shadowing of V-shaped grooves.

    Torrance and Sparrow 1967; Cook and Torrance 1982. The value must not be used where l = -v.
    """
    NoL, NoV, NoH = np.maximum(l[..., 2], 0), np.maximum(v[..., 2], 0), h[..., 2]
    # v.h = |l + v| / 2 for unit vectors. A dot product would suffer from the rounding of |l| and |v| near l = -v.
    VoH = 0.5 * np.sqrt(np.maximum(np.sum((l + v) ** 2, axis=-1), 1e-12))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        G = np.minimum(1, 2 * NoH * np.minimum(NoV, NoL) / VoH)
        result: Array = np.where(NoV > 0, G / (4 * NoV), 0.0)
    return result
