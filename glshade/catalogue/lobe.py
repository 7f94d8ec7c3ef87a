"""Lobes: a model's values laid out as plots want them, float64 arrays without matplotlib or GL. Angles are in radians.

Everything is in the local frame (n = +z, tangent = +x). A plane of incidence stands at `azimuth` to the tangent; angles in it
are signed: the light comes from -incidence, its mirror direction is +incidence. Errors: ValueError for a textured material.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, widened
from glshade.catalogue.albedo import albedo
from glshade.optics.fresnel import f0_conductor, f_conductor, f_dielectric, f_schlick

Array = NDArray[np.float64]
Quantity = Literal["f cos", "f"]

# Luminance of linear Rec. 709.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# A slice starts with this many points, a quarter of a degree apart, and with points closer and closer to where lobes have
# their peaks: 2^-20 is a tenth of the width of a lobe of exponent 1e10.
COARSE, CLOSEST = 721, 20
# Then it is cut where the curve rises by more than this share of its height (or of itself, above a ten-thousandth of it), and
# no more often than eight times, each of which halves the steps.
STEP, RATIO, ROUNDS = 0.01, 0.15, 8
# How far towards the horizon a lobe without bound is looked at, to find a scale for it [radians].
TOWARDS = np.radians(85.0)
# Angles of albedo curves, closer together towards the horizon; the last is a tenth of a degree above it.
ALBEDO_ANGLES = 33
LAST = np.radians(89.9)
# The estimated error of an albedo [1]. The true one may be some times as large: a curve shows 5e-3, eight bits 2e-3.
WITHIN = 1e-4


def direction(theta: Any, azimuth: float = 0.0) -> Array:
    """(..., 3): unit, at the signed angle theta (...) from the normal, in the plane at `azimuth` to the tangent."""
    theta = np.asarray(theta, dtype=np.float64)
    sine = np.sin(theta)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(theta)], axis=-1)


def values(material: Brdf, incidence: float, v: Array, azimuth: float = 0.0, quantity: Quantity = "f cos") -> Array:
    """(..., 3) [1/sr]: f cos, or f, towards v (..., 3) of light from -incidence.

    The cosine is the light's, so that f cos is the radiance that leaves where a beam of unit irradiance across itself arrives.
    """
    l = direction(-incidence, azimuth)
    if not l[2] > 1e-9:
        raise ValueError(f"incidence must be less than 90 degrees, not {np.degrees(incidence):g}")
    found = np.broadcast_to(type(material).brdf_cos(widened(material), np.broadcast_to(l, v.shape), v), v.shape)
    return found / l[2] if quantity == "f" else np.array(found)


def polar_slice(material: Brdf, incidence: float, azimuth: float = 0.0, quantity: Quantity = "f cos") -> tuple[Array, Array]:
    """(angles (N,), values (N, 3) [1/sr]): what leaves in the plane of incidence, from -90 to 90 degrees.

    The angles are as close together as the lobe needs, however narrow it is.
    """
    close = 2.0 ** -np.arange(CLOSEST + 1)
    around = np.concatenate([[0.0], close, -close])
    angles = np.concatenate(
        [np.linspace(-np.pi / 2, np.pi / 2, COARSE), *(peak + around for peak in (incidence, -incidence, 0.0))]
    )
    angles = np.unique(angles[np.abs(angles) <= np.pi / 2])
    found = values(material, incidence, direction(angles, azimuth), azimuth, quantity)
    for _ in range(ROUNDS):
        height = found.max(axis=1)
        step, peak = np.abs(np.diff(height)), height.max()
        steep = step > STEP * peak
        steep |= (step > RATIO * np.maximum(height[1:], height[:-1])) & (height[1:] > 1e-4 * peak) & (height[:-1] > 1e-4 * peak)
        # At a jump, the end of a lobe at its horizon, halving would never end.
        steep &= np.diff(angles) > 1e-7
        if not steep.any():
            break
        middle = (0.5 * (angles[1:] + angles[:-1]))[steep]
        order = np.argsort(np.concatenate([angles, middle]), kind="stable")
        new = values(material, incidence, direction(middle, azimuth), azimuth, quantity)
        angles, found = np.concatenate([angles, middle])[order], np.concatenate([found, new])[order]
    return angles, found


def unbounded(material: Brdf, incidence: float, azimuth: float = 0.0) -> bool:
    """Whether what leaves in the plane of incidence grows without end towards the horizon, as ward's and minnaert's does."""
    angles = np.arccos(np.array([1e-3, 1e-4]))
    height = np.stack([values(material, incidence, direction(side * angles, azimuth), azimuth).max(axis=1) for side in (1, -1)])
    # A power of n.v of -0.08 or less; where a lobe ends in the horizon, or goes through it, a decade changes next to nothing.
    return bool(np.any(height[:, 1] > 1.2 * height[:, 0]))


def drawn_height(theta: Array, height: Array, unbounded: bool) -> float:
    """The largest of the heights (N,) at the angles theta (N,) from the normal; of what has no largest, that up to TOWARDS."""
    inside = np.abs(theta) <= TOWARDS if unbounded else np.ones(len(theta), dtype=bool)
    return float(height[inside].max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Surface:
    """A lobe over the hemisphere: directions (V, 3), values (V, 3) [1/sr], triangles (T, 3), counter-clockwise from outside."""

    directions: Array
    values: Array
    triangles: NDArray[np.int64]

    def vertices(self, radius: Array) -> Array:
        """(V, 3): each direction at its radius (V,)."""
        return self.directions * radius[:, None]


def surface(material: Brdf, incidence: float, azimuth: float = 0.0, quantity: Quantity = "f cos") -> Surface:
    """The whole lobe; the plane of incidence is turned to y = 0, so that the light comes from -x. Vertices are denser about the
    mirror direction, the light's own and the normal."""
    theta = _dense(np.linspace(0, np.pi / 2 - 1e-6, 91), (incidence, 0.0), 0.0, np.pi / 2 - 1e-6)
    phi = _dense(np.linspace(-np.pi, np.pi, 181), (0.0, np.pi, -np.pi), -np.pi, np.pi)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    local = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    c, s = np.cos(azimuth), np.sin(azimuth)
    turned = local @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    a = (np.arange(len(theta) - 1)[:, None] * len(phi) + np.arange(len(phi) - 1)).ravel()
    b, d = a + len(phi), a + 1
    triangles = np.concatenate([np.stack([a, b, b + 1], axis=1), np.stack([a, b + 1, d], axis=1)])
    return Surface(local, values(material, incidence, turned, azimuth, quantity), triangles)


def _dense(uniform: Array, peaks: tuple[float, ...], low: float, high: float) -> Array:
    # From 20 degrees to a hundredth of one.
    close = np.geomspace(2e-4, 0.35, 24)
    found = np.concatenate([uniform, *(peak + np.concatenate([[0.0], close, -close]) for peak in peaks)])
    result: Array = np.unique(found[(found >= low) & (found <= high)])
    return result


def albedo_angles(count: int = ALBEDO_ANGLES) -> Array:
    """(count,): from the normal to just above the horizon, closer together there."""
    result: Array = LAST * (1 - (1 - np.linspace(0, 1, count)) ** 2)
    return result


def albedo_curve(material: Brdf, azimuth: float = 0.0, count: int = ALBEDO_ANGLES) -> tuple[Array, Array]:
    """(angles (count,), directional albedo (count, 3)), the viewer's angle from the normal; read-only."""
    return _albedo_curve(material, azimuth if material.needs_tangents else 0.0, count)


# A curve takes most of a second, and a furnace needs the one that is plotted beside it.
@lru_cache(maxsize=64)
def _albedo_curve(material: Brdf, azimuth: float, count: int) -> tuple[Array, Array]:
    angles = albedo_angles(count)
    curve = albedo(material, direction(angles, azimuth), within=WITHIN)
    angles.flags.writeable = curve.flags.writeable = False
    return angles, curve


def furnace(material: Brdf, size: int = 256) -> tuple[Array, Array]:
    """(albedo (size, size, 3), coverage (size, size)) of a sphere under a uniform sky of radiance 1, seen from afar.

    White furnace test: where nothing is lost, the albedo is 1 and the sphere cannot be told from the sky. The tangent runs
    round the vertical axis, as on glshade's own sphere; row 0 is the top.
    """
    step = (np.arange(size) + 0.5) * 2 / size - 1
    x, y = np.meshgrid(step, -step)
    # A little air round the sphere.
    x, y = x / 0.92, y / 0.92
    r = np.hypot(x, y)
    inside = np.minimum(r, 1.0)
    theta = np.arcsin(inside)
    pixel = 2 / size / 0.92
    coverage = np.clip((1 - r) / pixel + 0.5, 0, 1)
    if not material.needs_tangents:
        angles, curve = albedo_curve(material)
        return np.stack([np.interp(theta, angles, channel) for channel in curve.T], axis=-1), coverage
    z = np.sqrt(np.maximum(1 - r * r, 0.0))
    # v = (0, 0, 1) along the tangent (z, 0, -x) and the bitangent n x t; tangents have no sign, so half a turn is all.
    phi = np.arctan2(-y * z, -x) % np.pi
    angles, turns = albedo_angles(17), np.linspace(0, np.pi, 13)
    table = np.stack([albedo(material, direction(angles, turn), within=WITHIN) for turn in turns[:-1]])
    table = np.concatenate([table, table[:1]])
    return _bilinear(table, phi / turns[1], np.interp(theta, angles, np.arange(len(angles)))), coverage


def _bilinear(table: Array, row: Array, column: Array) -> Array:
    """(..., 3): the table (R, C, 3) at fractional places (...)."""
    i = np.minimum(row.astype(np.intp), table.shape[0] - 2)
    j = np.minimum(column.astype(np.intp), table.shape[1] - 2)
    a, b = (row - i)[..., None], (column - j)[..., None]
    result: Array = (1 - a) * ((1 - b) * table[i, j] + b * table[i, j + 1]) + a * (
        (1 - b) * table[i + 1, j] + b * table[i + 1, j + 1]
    )
    return result


@dataclass(frozen=True, eq=False)
class FresnelCurve:
    """label: of what; kind: the formula; reflectance (N, 3) at the angles (N,) between light and facet."""

    label: str
    kind: Literal["exact", "schlick"]
    angles: Array
    reflectance: Array


def fresnel_curves(material: Brdf, count: int = 181) -> tuple[FresnelCurve, ...]:
    """What the material's parameters say of Fresnel: none for a model without.

    Known by their names: eta and k (a conductor, or with k = 0 a dielectric) and ior, exact and by Schlick from the same
    reflectance at normal incidence; and by Schlick alone whatever is declared as a "reflectance at normal incidence", mixed
    with the base colour where the model has `metallic`.
    """
    m: Any = widened(material)
    declared = material.parameters()
    angles = np.linspace(0, np.pi / 2, count)
    # cos(pi/2) is 6e-17: the horizon is exactly 0.
    LoH = np.cos(angles)
    LoH[-1] = 0.0
    found: list[FresnelCurve] = []
    if {"eta", "k"} <= declared.keys():
        exact = f_conductor(m.eta, m.k, LoH)
        found.append(FresnelCurve("eta, k" if np.any(m.k) else "eta", "exact", angles, exact))
        found.append(FresnelCurve("", "schlick", angles, f_schlick(f0_conductor(m.eta, m.k), LoH)))
    if "ior" in declared:
        exact = np.repeat(f_dielectric(LoH, m.ior)[:, None], 3, axis=1)
        found.append(FresnelCurve("ior", "exact", angles, exact))
        found.append(FresnelCurve("", "schlick", angles, f_schlick(np.full(3, ((m.ior - 1) / (m.ior + 1)) ** 2), LoH)))
    for name, parameter in declared.items():
        if re.search(r"\breflectance at normal incidence", parameter.description):
            f0 = getattr(m, name)
            if name == "f0" and {"metallic", "kd"} <= declared.keys():
                f0 = f0 + (m.kd - f0) * m.metallic
            found.append(FresnelCurve(name, "schlick", angles, f_schlick(np.broadcast_to(f0, 3), LoH)))
    return tuple(found)
