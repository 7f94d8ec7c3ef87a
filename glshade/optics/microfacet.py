"""Microfacets: what the distributions of slopes and their shadowing make of a lobe, in float64.

l, v, h (..., 3): unit, in the local frame, z along the normal, x along the tangent; h the half vector of l and v.
"""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# A mirror shows no point light, so a lobe has a least width. Textures with black texels stay finite by it.
LEAST_ROUGHNESS = 0.01


def alpha(roughness: Array) -> Array:
    """The width of a distribution (Burley 2012, section 5.4): steps of equal size look equal."""
    result: Array = np.maximum(roughness, LEAST_ROUGHNESS) ** 2
    return result


def alphas(roughness: Array, anisotropy: Array | float) -> tuple[Array, Array]:
    """The widths along x and y (Burley 2012, section 5.4), anisotropy in [0, 1]."""
    a, aspect = alpha(roughness), (1 - 0.9 * anisotropy) ** 0.5
    return a / aspect, a * aspect


def ggx_cos(l: Array, v: Array, h: Array, roughness: Array, anisotropy: Array | float = 0.0) -> Array:
    """(...): GGX, D V n.l [1/sr], V = G2 / (4 n.l n.v), with Smith's G2, height-correlated; finite above the horizon.

    Walter et al. 2007, eq. 33; Burley 2012, eq. 13; Heitz 2014, eq. 99.
    """
    ax, ay = alphas(roughness, anisotropy)
    slope2 = (h[..., 0] / ax) ** 2 + (h[..., 1] / ay) ** 2 + h[..., 2] ** 2

    def stretched(d: Array) -> Array:
        length: Array = np.sqrt((ax * d[..., 0]) ** 2 + (ay * d[..., 1]) ** 2 + d[..., 2] ** 2)
        return length

    NoL, NoV = l[..., 2], v[..., 2]
    # A slope2 of 0 is that of no half vector; the caller leaves it out.
    below = 2 * (NoL * stretched(v) + NoV * stretched(l)) * math.pi * ax * ay * slope2**2
    result: Array = NoL / np.maximum(below, 1e-30)
    return result


def d_beckmann(h: Array, a: Array) -> Array:
    """(...): Beckmann's distribution, D [1/sr] (Beckmann and Spizzichino 1963; Walter et al. 2007, eq. 25)."""
    sin2 = h[..., 0] ** 2 + h[..., 1] ** 2
    # Below 1e-8 the exponential is 0 for every alpha up to 1.
    cos2 = np.maximum(h[..., 2] ** 2, 1e-8)
    result: Array = np.exp(-sin2 / (a * a * cos2)) / (math.pi * a * a * cos2 * cos2)
    return result


_erfc = np.vectorize(math.erfc, otypes=[np.float64])


def ierfc(x: Array) -> Array:
    """exp(-x^2)/sqrt(pi) - x erfc(x), the integral of erfc from x on; exact to 1e-16, and 0 from x = 27."""
    x = np.minimum(x, 27.0)
    result: Array = np.maximum(np.exp(-x * x) / math.sqrt(math.pi) - x * _erfc(x), 0.0)
    return result


def smith_beckmann(l: Array, v: Array, a: Array) -> Array:
    """(...): G2/(4 n.v) with Smith's shadowing for Beckmann's distribution, height-correlated.

    G2 = 1/(1 + Lambda(l) + Lambda(v)), Lambda = (erf(x) - 1)/2 + exp(-x^2)/(2 x sqrt(pi)) = ierfc(x)/(2 x), x = cos/(alpha sin)
    (Smith 1967; Heitz 2014, eq. 99). What is below the horizon counts as in it.
    """
    NoL, NoV = np.maximum(l[..., 2], 0), np.maximum(v[..., 2], 0)

    def hidden(d: Array) -> Array:
        """n.d Lambda(d), finite in the horizon."""
        spread = a * np.sqrt(d[..., 0] ** 2 + d[..., 1] ** 2)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = np.where(spread > 0, np.maximum(d[..., 2], 0) / spread, np.inf)
        result: Array = spread / 2 * ierfc(x)
        return result

    result: Array = NoL / np.maximum(4 * (NoL * NoV + NoL * hidden(v) + NoV * hidden(l)), 1e-150)
    return result


def v_groove(l: Array, v: Array, h: Array) -> Array:
    """(...): G/(4 n.v) with the shadowing of V-shaped grooves, G = min(1, 2 (n.h)(n.v)/(v.h), 2 (n.h)(n.l)/(v.h)).

    Torrance and Sparrow 1967; Cook and Torrance 1982. Where l = -v it is not to be used.
    """
    NoL, NoV, NoH = np.maximum(l[..., 2], 0), np.maximum(v[..., 2], 0), h[..., 2]
    # v.h = |l + v| / 2 for unit vectors; as a dot product it would feel the rounding of |l| and |v| near l = -v.
    VoH = 0.5 * np.sqrt(np.maximum(np.sum((l + v) ** 2, axis=-1), 1e-12))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        G = np.minimum(1, 2 * NoH * np.minimum(NoV, NoL) / VoH)
        result: Array = np.where(NoV > 0, G / (4 * NoV), 0.0)
    return result
