"""Rusinkiewicz: two directions as the angles of their half vector and of their difference (Rusinkiewicz 1998).

theta_h is the angle between the normal n and the half vector h of l and v. theta_d is the angle between h and l. phi_d is the
azimuth of l about h, and 0 where l leans away from n: l is turned by the rotation that takes h to n in the plane of both, and
phi_d is its azimuth then, counted from the direction into which h leans. Surfaces without a grain depend on these three alone.

Reflectors that send light back to its source are described about the back vector, which is the half vector of v and of the
mirror direction of l (Neumann and Neumann 1996; Belcour et al. 2014). `mirrored` gives that direction, and all the rest stays.
"""

from __future__ import annotations

import numpy as np

from glshade.arrays import Array, Float64


def mirrored(l: Array) -> Array:
    """Returns the mirror directions of unit directions l (..., 3) about the normal, which is +z."""
    result: Array = l * np.array([-1.0, -1.0, 1.0])
    return result


def angles(l: Array, v: Array) -> tuple[Float64, Float64, Float64]:
    """Returns theta_h, theta_d and phi_d, each (...) [rad], of unit directions l and v (..., 3).

    The angles are computed from the lengths of differences, because the arc cosine loses half of the digits of a small angle.
    Where phi_d has no meaning, for h = n and for l = v, it may have any value.
    """
    sum_, difference = l + v, l - v
    length = np.linalg.norm(sum_, axis=-1, keepdims=True)
    h = np.divide(sum_, length, out=np.zeros_like(sum_), where=length > 0)
    theta_h = 2 * np.arcsin(np.minimum(np.linalg.norm(h - np.array([0.0, 0.0, 1.0]), axis=-1) / 2, 1))
    theta_d = np.arcsin(np.minimum(np.linalg.norm(difference, axis=-1) / 2, 1))
    # These are the sine and the cosine of phi_d, both multiplied by 2 sin(theta_d) sin(theta_h).
    across = h[..., 0] * difference[..., 1] - h[..., 1] * difference[..., 0]
    return theta_h, theta_d, np.arctan2(across, -difference[..., 2])


def directions(theta_h: Array, theta_d: Array, phi_d: Array) -> tuple[Float64, Float64]:
    """Returns the unit directions l and v (..., 3) with these angles (...) [rad]; their half vector leans toward +x."""
    sine_h, cosine_h = np.sin(theta_h), np.cos(theta_h)
    sine_d, cosine_d = np.sin(theta_d), np.cos(theta_d)
    x, y = sine_d * np.cos(phi_d), sine_d * np.sin(phi_d)
    middle = np.stack([cosine_d * sine_h, np.zeros_like(y), cosine_d * cosine_h], axis=-1)
    half_of_difference = np.stack([x * cosine_h, y, -x * sine_h], axis=-1)
    return middle + half_of_difference, middle - half_of_difference


def spherical(theta: Array, phi: Array) -> Float64:
    """Returns the unit directions (..., 3) at the angles theta (...) from the normal with the azimuths phi (...) [rad]."""
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
