"""Lights: the direction and the strength of a light at points of a surface."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from support.third.vectors import Array, dot, unit

# The power of the distance by which the light is divided.
FALLOFFS = {"none": 0, "1/r": 1, "1/r^2": 2}


def intensity(light: Mapping[str, Any]) -> Array:
    """Returns the light's intensity (3,), linear Rec. 709."""
    return np.broadcast_to(np.asarray(light.get("colour", 1.0), dtype=np.float64), (3,)) * light.get("intensity", 1.0)


def reaching(light: Mapping[str, Any], p: Array) -> tuple[Array, Array]:
    """Returns the unit directions to a light (N, 3) and the light that arrives (N, 3) at points p (N, 3) in world space."""
    strength = np.broadcast_to(intensity(light), p.shape)
    if light["type"] == "directional":
        toward = unit(-np.array(light.get("direction", (-0.4, -0.6, -0.7)), dtype=np.float64))
        return np.broadcast_to(toward, p.shape), strength
    way = np.array(light["position"], dtype=np.float64) - p
    distance = np.maximum(np.sqrt(dot(way, way)), light.get("r_min", 1e-3))
    strength = strength / distance ** FALLOFFS[light.get("falloff", "1/r^2")]
    return unit(way), strength * _cone(light, unit(way))


def _cone(light: Mapping[str, Any], toward: Array) -> Array | float:
    """Returns the share (N, 1) of the light that leaves it in the directions -toward (N, 3)."""
    if light["type"] == "point":
        return 1.0
    along = dot(-toward, unit(np.array(light.get("direction", (0, -1, 0)), dtype=np.float64)))
    if light["type"] == "spot":
        outer = light.get("outer", 30.0)
        inner = light.get("inner", 2 * outer / 3)
    else:
        outer, inner = light.get("outer", 45.0), light.get("inner", 0.0)
    cos_inner, cos_outer = math.cos(math.radians(inner)), math.cos(math.radians(outer))
    x = np.clip((along - cos_outer) / (cos_inner - cos_outer), 0, 1)
    return x * x * (3 - 2 * x) if light["type"] == "spot" else x * x
