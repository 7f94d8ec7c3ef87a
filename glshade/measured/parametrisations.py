"""Parametrisations: the ways in which ALTA's files describe two directions, by ALTA's names.

ALTA is the library for the analysis of BRDFs by Belcour, Barla and Pacanowski (2014). In its names, L is the direction to the
light, V that to the viewer, H their half vector, D the difference of V from H, K the back vector, and T and P are angles from
the normal and azimuths. Where two angles describe a pair of directions, the difference direction D is that of V.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from glshade.arrays import Array, Float64
from glshade.measured.rusinkiewicz import directions, mirrored, spherical
from glshade.measured.samples import AXES, Axis

Pair = tuple[Float64, Float64]


@dataclass(frozen=True)
class Parametrisation:
    """A way to describe a pair of directions by numbers.

    columns: how many numbers there are.
    pair: takes the columns, each (N,), and returns l and v (N, 3). Directions that do not exist are NaN.
    axes: the angles that the numbers vary.
    retro: whether these angles are those about the back vector; None where both descriptions are complete.
    """

    columns: int
    pair: Callable[..., Pair]
    axes: tuple[Axis, ...] = AXES
    retro: bool | None = None


def _half(theta_h: Array, phi_h: Array, theta_d: Array, phi_d: Array) -> Pair:
    """Returns l and v of their half vector's angles and those of v about it [rad]."""
    v, l = directions(theta_h, theta_d, phi_d)
    return _turned(l, phi_h), _turned(v, phi_h)


def _turned(directions: Float64, phi: Array) -> Float64:
    """Returns directions (N, 3) turned about the normal by the angles phi (N,) [rad]."""
    c, s = np.cos(phi), np.sin(phi)
    x, y, z = directions.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def _back(theta_k: Array, theta_d: Array, phi_d: Array) -> Pair:
    """Returns l and v of the back vector's angle from the normal and the angles of v about it [rad]."""
    l, v = _half(theta_k, np.zeros_like(theta_k), theta_d, phi_d)
    return mirrored(l), v


def _projected(x: Array, y: Array) -> Float64:
    """Returns the directions whose angle from the normal and azimuth are the polar coordinates of x and y [rad]."""
    return spherical(np.hypot(x, y), np.arctan2(y, x))


def _lights(theta_l: Array) -> Float64:
    return spherical(theta_l, np.zeros_like(theta_l))


def _about_light(theta_l: Array, x: Array, y: Array) -> Pair:
    """Returns l, and v whose angle from l and whose azimuth about l are the polar coordinates of x and y; x points to the
    normal."""
    l = _lights(theta_l)
    angle, azimuth = np.hypot(x, y), np.arctan2(y, x)
    towards_normal = np.stack([-np.cos(theta_l), np.zeros_like(theta_l), np.sin(theta_l)], axis=-1)
    across = np.array([0.0, 1.0, 0.0])
    side = np.cos(azimuth)[:, None] * towards_normal + np.sin(azimuth)[:, None] * across
    return l, np.cos(angle)[:, None] * l + np.sin(angle)[:, None] * side


def _about_back(theta_l: Array, x: Array, y: Array) -> Pair:
    """Returns l, and v of a back vector whose angle from the normal and azimuth are the polar coordinates of x and y."""
    l, k = _lights(theta_l), _projected(x, y)
    r = mirrored(l)
    return l, 2 * np.sum(r * k, axis=-1, keepdims=True) * k - r


def _halves(half: Float64, back: Float64) -> Pair:
    """Returns l and v, given half their sum (N, 3) and half their difference l - v (N, 3)."""
    return half + back, half - back


def _height(square: Array) -> Array:
    """Returns the square roots of numbers (N,); the root of a negative number is NaN."""
    return np.sqrt(np.where(square >= 0, square, np.nan))


def _stark(h: Array, b: Array, phi: Array) -> Pair:
    """Returns l and v in the parametrisation of Stark et al. 2005, as ALTA defines it.

    h: the length of the projected half sum.
    b: the length of the half difference.
    phi: the difference of their azimuths [rad].
    """
    height = _height(1 - h * h - b * b)
    # The half difference is perpendicular to the half sum (h, 0, height).
    slope = np.arctan2(height, -h * np.cos(phi))
    sine = np.sin(slope)
    back = np.stack([b * sine * np.cos(phi), b * sine * np.sin(phi), b * np.cos(slope)], axis=-1)
    return _halves(np.stack([h, np.zeros_like(h), height], axis=-1), back)


def _neumann(h: Array, b: Array, phi: Array) -> Pair:
    """Returns l and v of the lengths of the projected half sum and half difference of v and l, and their azimuths' difference
    (Neumann and Neumann 1996)."""
    x, y = b * np.cos(phi), b * np.sin(phi)
    flat = np.stack([h - x, -y], axis=-1), np.stack([h + x, y], axis=-1)
    l, v = (np.concatenate([end, _height(1 - np.sum(end**2, axis=-1))[:, None]], axis=-1) for end in flat)
    return l, v


def _stereographic(x_v: Array, y_v: Array, x_l: Array, y_l: Array) -> Pair:
    """Returns l and v of their stereographic projections from the south pole to the plane of the surface."""
    v, l = (
        np.stack([2 * x, 2 * y, 1 - x * x - y * y], axis=-1) / (1 + x * x + y * y)[:, None] for x, y in ((x_v, y_v), (x_l, y_l))
    )
    return l, v


def _arc_cosine(cosine: Array) -> Float64:
    """Returns arc cosines [rad]; NaN outside of -1 to 1, except for an excess by rounding."""
    return np.arccos(np.where(np.abs(cosine) <= 1 + 1e-9, np.clip(cosine, -1, 1), np.nan))


def _of_half_vector(x: Array, y: Array, z: Array) -> Pair:
    length = np.sqrt(x * x + y * y + z * z)
    zero = np.zeros_like(x)
    return _half(_arc_cosine(z / length), np.arctan2(y, x), zero, zero)


def _of_back_vector(x: Array, y: Array, z: Array) -> Pair:
    length = np.sqrt(x * x + y * y + z * z)
    zero = np.zeros_like(x)
    return _back(_arc_cosine(z / length), zero, zero)


def _zero(value: Array) -> Array:
    return np.zeros_like(value)


def _right(value: Array) -> Array:
    return np.full_like(value, math.pi / 2)


HALF_ONLY: tuple[Axis, ...] = ("theta_h",)
WITHOUT_PHI: tuple[Axis, ...] = ("theta_h", "theta_d")
DIFFERENCE_ONLY: tuple[Axis, ...] = ("theta_d",)

# ALTA's name -> the parametrisation. ALTA writes SCHLICK_VH for the one that its documentation calls SCHLICK_VK.
PARAMETRISATIONS: dict[str, Parametrisation] = {
    "COS_TH": Parametrisation(1, lambda c: _half(_arc_cosine(c), _zero(c), _zero(c), _zero(c)), HALF_ONLY, False),
    "COS_TK": Parametrisation(1, lambda c: _back(_arc_cosine(c), _zero(c), _zero(c)), HALF_ONLY, True),
    "COS_TLV": Parametrisation(1, lambda c: _half(_zero(c), _zero(c), _arc_cosine(c) / 2, _zero(c)), DIFFERENCE_ONLY, False),
    "COS_TLR": Parametrisation(1, lambda c: _back(_zero(c), _arc_cosine(c) / 2, _zero(c)), DIFFERENCE_ONLY, True),
    "COS_TH_TD": Parametrisation(
        2, lambda h, d: _half(_arc_cosine(h), _zero(h), _arc_cosine(d), _right(h)), WITHOUT_PHI, False
    ),
    "RUSIN_TH_TD": Parametrisation(2, lambda h, d: _half(h, _zero(h), d, _right(h)), WITHOUT_PHI, False),
    "ISOTROPIC_TV_PROJ_DPHI": Parametrisation(2, lambda x, y: (_lights(_zero(x)), _projected(x, y))),
    "STARK_2D": Parametrisation(2, lambda h, b: _stark(h, b, _right(h)), WITHOUT_PHI, False),
    "NEUMANN_2D": Parametrisation(2, lambda h, b: _neumann(h, b, _right(h)), WITHOUT_PHI, False),
    "ISOTROPIC_TV_TL": Parametrisation(2, lambda v, l: (_lights(l), spherical(v, _zero(v)))),
    "ISOTROPIC_TV_TL_DPHI": Parametrisation(3, lambda v, l, phi: (spherical(l, phi), _lights(v))),
    "ISOTROPIC_TL_TV_PROJ_DPHI": Parametrisation(3, lambda l, x, y: (_lights(l), _projected(x, y))),
    "RUSIN_TH_TD_PD": Parametrisation(3, lambda h, d, phi: _half(h, _zero(h), d, phi)),
    "RUSIN_TH_PH_TD": Parametrisation(3, lambda h, phi, d: _half(h, phi, d, _right(h)), WITHOUT_PHI, False),
    "RUSIN_VH": Parametrisation(3, _of_half_vector, HALF_ONLY, False),
    "SCHLICK_VK": Parametrisation(3, _of_back_vector, HALF_ONLY, True),
    "SCHLICK_VH": Parametrisation(3, _of_back_vector, HALF_ONLY, True),
    "SCHLICK_TL_TK_PROJ_DPHI": Parametrisation(3, _about_back),
    "RETRO_TL_TVL_PROJ_DPHI": Parametrisation(3, _about_light),
    "STARK_3D": Parametrisation(3, _stark),
    "NEUMANN_3D": Parametrisation(3, _neumann),
    "RUSIN_TH_PH_TD_PD": Parametrisation(4, _half),
    "SPHERICAL_TL_PL_TV_PV": Parametrisation(4, lambda tl, pl, tv, pv: (spherical(tl, pl), spherical(tv, pv))),
    "STEREOGRAPHIC": Parametrisation(4, _stereographic),
    "CARTESIAN": Parametrisation(6, lambda vx, vy, vz, lx, ly, lz: (_unit(lx, ly, lz), _unit(vx, vy, vz))),
}


def _unit(x: Array, y: Array, z: Array) -> Float64:
    """Returns unit directions (N, 3); NaN for a vector whose length is not 1 within a thousandth."""
    length = np.sqrt(x * x + y * y + z * z)
    return np.stack([x, y, z], axis=-1) / np.where(np.abs(length - 1) < 1e-3, length, np.nan)[:, None]
