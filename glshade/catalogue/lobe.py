"""Lobe: the values of a model as slices, surfaces and curves for plots, in float64 and without matplotlib or OpenGL.

A model's value f is the ratio of reflected radiance to irradiance [1/sr], and "f cos" is f times the cosine of the light's
angle from the normal. Shapes such as (...) stand for any shape, and (..., 3) for the same shape with a last axis of 3 numbers.

All directions are in the local frame (n = +z, tangent = +x), and all angles are in radians. The plane of incidence contains the
normal and makes the angle `azimuth` with the tangent. Angles from the normal in that plane are signed: the light comes from
-incidence, and its mirror direction is at +incidence. Functions that take a material raise ValueError if it is textured.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, widened
from glshade.catalogue.albedo import directional_albedo
from glshade.errors import figure
from glshade.optics.fresnel import f0_conductor, f_conductor, f_dielectric, f_schlick

Array = NDArray[np.float64]
Quantity = Literal["f cos", "f"]

# The weights of linear Rec. 709 colours in their luminance.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# A slice starts with COARSE points, a quarter of a degree apart. Around the angles where lobes peak it has further points, at
# distances from 1 down to 2^-CLOSEST [rad], which is a tenth of the width of a lobe of exponent 1e10.
COARSE, CLOSEST = 721, 20
# After that, steps of the slice are halved, in at most ROUNDS rounds, as long as the curve changes within a step by more than
# STEP times its highest value, or by more than RATIO times its value at that step.
STEP, RATIO, ROUNDS = 0.01, 0.15, 8
# The largest angle from the normal that counts in the scale of a lobe that grows without bound towards the horizon [rad].
TOWARDS = np.radians(85.0)
# The number of angles of an albedo curve, and the last angle, a tenth of a degree above the horizon [rad].
ALBEDO_ANGLES = 33
LAST = np.radians(89.9)
# The estimated error of an albedo [1]. The true error may be several times as large, but it stays below the smallest error that
# is visible: 5e-3 in a curve, 2e-3 in a picture of 8 bits.
WITHIN = 1e-4


def direction(theta: Any, azimuth: float = 0.0) -> Array:
    """Returns unit directions (..., 3) at the signed angles theta (...) from the normal in the plane of incidence."""
    theta = np.asarray(theta, dtype=np.float64)
    sine = np.sin(theta)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(theta)], axis=-1)


def values(material: Brdf, incidence: float, v: Array, azimuth: float = 0.0, quantity: Quantity = "f cos") -> Array:
    """Returns f cos or f (..., 3) [1/sr] for the light from -incidence and viewers in the directions v (..., 3).

    f cos is the radiance that the surface reflects, if the light has an irradiance of 1 on a surface that faces it.
    Errors: ValueError where incidence is 90 degrees or more.
    """
    l = direction(-incidence, azimuth)
    if not l[2] > 1e-9:
        raise ValueError(f"incidence must be less than 90 degrees, not {figure(np.degrees(incidence))}")
    f_cos = np.broadcast_to(type(material).brdf_cos(widened(material), np.broadcast_to(l, v.shape), v), v.shape)
    return f_cos / l[2] if quantity == "f" else np.array(f_cos)


def polar_slice(material: Brdf, incidence: float, azimuth: float = 0.0, quantity: Quantity = "f cos") -> tuple[Array, Array]:
    """Returns (angles (N,) [rad], values (N, 3) [1/sr]) of the lobe in the plane of incidence, from -90 to 90 degrees.

    The angles are closer together where the lobe is narrow.
    """
    close = 2.0 ** -np.arange(CLOSEST + 1)
    around = np.concatenate([[0.0], close, -close])
    angles = np.concatenate(
        [np.linspace(-np.pi / 2, np.pi / 2, COARSE), *(peak + around for peak in (incidence, -incidence, 0.0))]
    )
    angles = np.unique(angles[np.abs(angles) <= np.pi / 2])
    slice_values = values(material, incidence, direction(angles, azimuth), azimuth, quantity)
    for _ in range(ROUNDS):
        height = slice_values.max(axis=1)
        step, peak = np.abs(np.diff(height)), height.max()
        steep = step > STEP * peak
        steep |= (step > RATIO * np.maximum(height[1:], height[:-1])) & (height[1:] > 1e-4 * peak) & (height[:-1] > 1e-4 * peak)
        # Some lobes jump to 0 at an angle before 90 degrees. At such a jump, halving would never make the steps small enough.
        steep &= np.diff(angles) > 1e-7
        if not steep.any():
            break
        middle = (0.5 * (angles[1:] + angles[:-1]))[steep]
        order = np.argsort(np.concatenate([angles, middle]), kind="stable")
        new = values(material, incidence, direction(middle, azimuth), azimuth, quantity)
        angles, slice_values = np.concatenate([angles, middle])[order], np.concatenate([slice_values, new])[order]
    return angles, slice_values


def unbounded(material: Brdf, incidence: float, azimuth: float = 0.0) -> bool:
    """Returns whether the lobe grows without bound towards the horizon in the plane of incidence, as for ward and minnaert."""
    angles = np.arccos(np.array([1e-3, 1e-4]))
    height = np.stack([values(material, incidence, direction(side * angles, azimuth), azimuth).max(axis=1) for side in (1, -1)])
    # The two angles have cosines n.v of 1e-3 and 1e-4. A lobe that is 1.2 times as high at the second one grows like a power of
    # n.v with an exponent of -0.08 or less. Bounded lobes hardly change so close to the horizon.
    return bool(np.any(height[:, 1] > 1.2 * height[:, 0]))


def drawn_height(theta: Array, height: Array, unbounded: bool) -> float:
    """Returns the largest of the heights (N,) at the angles theta (N,) from the normal, for the scale of a plot.

    unbounded: True for a lobe that grows without bound, of which only the angles up to TOWARDS count.
    """
    inside = np.abs(theta) <= TOWARDS if unbounded else np.ones(len(theta), dtype=bool)
    return float(height[inside].max(initial=0.0))


@dataclass(frozen=True, eq=False)
class LobeMesh:
    """A lobe over the hemisphere as a mesh of V vertices.

    directions: (V, 3), unit.
    values: (V, 3), f cos or f in these directions [1/sr].
    triangles: (T, 3), indices of vertices, counter-clockwise as seen from outside.
    """

    directions: Array
    values: Array
    triangles: NDArray[np.int64]

    def vertices(self, radius: Array) -> Array:
        """Returns the positions (V, 3) of the vertices at the distances radius (V,) from the centre."""
        return self.directions * radius[:, None]


def surface(material: Brdf, incidence: float, azimuth: float = 0.0, quantity: Quantity = "f cos") -> LobeMesh:
    """Returns the whole lobe as a mesh, turned so that its plane of incidence is y = 0 and the light comes from -x.

    The vertices are denser around the mirror direction, the direction to the light and the normal.
    """
    theta = _dense(np.linspace(0, np.pi / 2 - 1e-6, 91), (incidence, 0.0), 0.0, np.pi / 2 - 1e-6)
    phi = _dense(np.linspace(-np.pi, np.pi, 181), (0.0, np.pi, -np.pi), -np.pi, np.pi)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    local = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    c, s = np.cos(azimuth), np.sin(azimuth)
    turned = local @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    a = (np.arange(len(theta) - 1)[:, None] * len(phi) + np.arange(len(phi) - 1)).ravel()
    b, d = a + len(phi), a + 1
    triangles = np.concatenate([np.stack([a, b, b + 1], axis=1), np.stack([a, b + 1, d], axis=1)])
    return LobeMesh(local, values(material, incidence, turned, azimuth, quantity), triangles)


def _dense(uniform: Array, peaks: tuple[float, ...], low: float, high: float) -> Array:
    """Returns angles in ascending order from low to high: the `uniform` ones (N,), and further ones around the peaks."""
    # The distances from a peak go from 0.01 to 20 degrees.
    close = np.geomspace(2e-4, 0.35, 24)
    angles = np.concatenate([uniform, *(peak + np.concatenate([[0.0], close, -close]) for peak in peaks)])
    result: Array = np.unique(angles[(angles >= low) & (angles <= high)])
    return result


def albedo_angles(count: int = ALBEDO_ANGLES) -> Array:
    """Returns angles (count,) from the normal to just above the horizon, closer together near the horizon [rad]."""
    result: Array = LAST * (1 - (1 - np.linspace(0, 1, count)) ** 2)
    return result


def albedo_curve(material: Brdf, azimuth: float = 0.0, count: int = ALBEDO_ANGLES) -> tuple[Array, Array]:
    """Returns (the viewer's angles (count,), the directional albedo (count, 3) at each). The arrays are read-only."""
    return _albedo_curve(material, azimuth if material.needs_tangents else 0.0, count)


# Cached, because a curve takes most of a second and is needed twice: for its own panel and for the panel of the furnace.
@lru_cache(maxsize=64)
def _albedo_curve(material: Brdf, azimuth: float, count: int) -> tuple[Array, Array]:
    angles = albedo_angles(count)
    curve = directional_albedo(material, direction(angles, azimuth), within=WITHIN)
    angles.flags.writeable = curve.flags.writeable = False
    return angles, curve


def furnace(material: Brdf, size: int = 256) -> tuple[Array, Array]:
    """Returns (albedo (size, size, 3), coverage (size, size)) of a sphere under a uniform sky of radiance 1, seen from afar.

    This is the white furnace test: if a material loses no light, its albedo is 1 and the sphere looks like the sky. Tangents
    run around the vertical axis, as on glshade's sphere. Row 0 is the top. The coverage is the share of a pixel's area that
    the sphere covers.
    """
    step = (np.arange(size) + 0.5) * 2 / size - 1
    x, y = np.meshgrid(step, -step)
    # The sphere's radius is 0.92 times half the picture's side, which leaves a margin of sky.
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
    # phi is the angle between v = (0, 0, 1) and the tangent t = (z, 0, -x), both projected to the tangent plane. An albedo is
    # the same for t and -t, so half a turn of angles is enough.
    phi = np.arctan2(-y * z, -x) % np.pi
    angles, turns = albedo_angles(17), np.linspace(0, np.pi, 13)
    table = np.stack([directional_albedo(material, direction(angles, turn), within=WITHIN) for turn in turns[:-1]])
    table = np.concatenate([table, table[:1]])
    return _bilinear(table, phi / turns[1], np.interp(theta, angles, np.arange(len(angles)))), coverage


def _bilinear(table: Array, row: Array, column: Array) -> Array:
    """Interpolates the table (R, C, 3) at fractional rows and columns (...), and returns the values (..., 3)."""
    i = np.minimum(row.astype(np.intp), table.shape[0] - 2)
    j = np.minimum(column.astype(np.intp), table.shape[1] - 2)
    a, b = (row - i)[..., None], (column - j)[..., None]
    result: Array = (1 - a) * ((1 - b) * table[i, j] + b * table[i, j + 1]) + a * (
        (1 - b) * table[i + 1, j] + b * table[i + 1, j + 1]
    )
    return result


@dataclass(frozen=True, eq=False)
class FresnelCurve:
    """A curve of the Fresnel reflectance over the angle of incidence, with N points.

    label: the parameter that the curve comes from; empty for a curve that approximates the one before it.
    kind: the formula, "exact" for Fresnel's equations or "schlick" for Schlick's approximation.
    angles: (N,), between the light and the facet's normal [rad].
    reflectance: (N, 3) [1].
    """

    label: str
    kind: Literal["exact", "schlick"]
    angles: Array
    reflectance: Array


def fresnel_curves(material: Brdf, count: int = 181) -> tuple[FresnelCurve, ...]:
    """Returns the curves of Fresnel reflectance that a material's parameters imply; empty if no parameter implies one.

    The parameters eta and k (a complex index of refraction: a conductor, or with k = 0 a dielectric) give two curves, and so
    does ior (the index of a dielectric): one by Fresnel's equations, and one by Schlick's approximation with the same
    reflectance at normal incidence. A parameter described as a "reflectance at normal incidence" gives a curve by Schlick's
    approximation; if the model has `metallic`, the parameter is mixed with the base colour first.
    count: the number of angles.
    """
    m: Any = widened(material)
    declared = material.parameters()
    angles = np.linspace(0, np.pi / 2, count)
    # In float64 cos(pi/2) is 6e-17, but the curve has to end at 0.
    LoH = np.cos(angles)
    LoH[-1] = 0.0
    curves: list[FresnelCurve] = []
    if {"eta", "k"} <= declared.keys():
        exact = f_conductor(m.eta, m.k, LoH)
        curves.append(FresnelCurve("eta, k" if np.any(m.k) else "eta", "exact", angles, exact))
        curves.append(FresnelCurve("", "schlick", angles, f_schlick(f0_conductor(m.eta, m.k), LoH)))
    if "ior" in declared:
        exact = np.repeat(f_dielectric(LoH, m.ior)[:, None], 3, axis=1)
        curves.append(FresnelCurve("ior", "exact", angles, exact))
        curves.append(FresnelCurve("", "schlick", angles, f_schlick(np.full(3, ((m.ior - 1) / (m.ior + 1)) ** 2), LoH)))
    for name, parameter in declared.items():
        if re.search(r"\breflectance at normal incidence", parameter.description):
            f0 = getattr(m, name)
            if name == "f0" and {"metallic", "kd"} <= declared.keys():
                f0 = f0 + (m.kd - f0) * m.metallic
            curves.append(FresnelCurve(name, "schlick", angles, f_schlick(np.broadcast_to(f0, 3), LoH)))
    return tuple(curves)
