"""Values: an assembly's numbers as both renderers are given them, rounded once to float32."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly
from glshade.brdfs import Array, Brdf, parameter_values
from glshade.lights import Falloff, Light
from glshade.textures.texture import DirectionMap, Texture


def direction(material: Brdf) -> Array:
    """(2,): cos and sin of the angle by which tangents are turned."""
    angle = math.radians(turn(material) % 360)
    return np.array([math.cos(angle), math.sin(angle)])


def normal_matrix(linear: Array) -> Array:
    """(3, 3): the direction of the inverse transpose, as the cofactor matrix over its largest entry.

    The sign of the determinant keeps normals on the outside of mirrored objects. Scaled first, so that 1e-200 does not vanish.
    """
    # Plain numbers: numpy takes twenty times as long for nine.
    (a, b, c), (d, e, f), (g, h, i) = (linear / np.abs(linear).max()).tolist()
    cofactors = np.array(
        [
            [e * i - f * h, f * g - d * i, d * h - e * g],
            [h * c - i * b, i * a - g * c, g * b - h * a],
            [b * f - c * e, c * d - a * f, a * e - b * d],
        ]
    )
    sign = math.copysign(1.0, a * cofactors[0, 0] + b * cofactors[0, 1] + c * cofactors[0, 2])
    result: Array = sign * cofactors / np.abs(cofactors).max()
    return result


def light_values(light: Light, eye: Array, exposure: float) -> dict[str, NDArray[np.float32]]:
    """The GLSL struct's fields. The intensity comes with exposure, and with the pi of pi (f cos) I."""
    values = light.uniforms(eye)
    gain = 2.0**exposure * (1.0 if light.omnidirectional else math.pi)
    values["intensity"] = values["intensity"] * gain
    if "r_min" in values:
        # float32 ends at 3e38, and infinite light from no direction would be NaN.
        strongest = float(np.abs(values["intensity"]).max())
        values["r_min"] = max(values["r_min"], least_distance(strongest, getattr(light, "falloff", "none")))
    return {name: rounded(value) for name, value in values.items()}


# The strongest light that a point is given.
BRIGHTEST = 1e38


FALLOFF_POWERS: dict[Falloff, int] = {"none": 0, "1/r": 1, "1/r^2": 2}


def least_distance(strength: float, falloff: Falloff) -> float:
    """The r_min [scene units] below which light of that strength exceeds BRIGHTEST: 2e-19 for 1/r^2 and a strength of 4."""
    power = FALLOFF_POWERS[falloff]
    # 4e-38 is the least: a normal number, as is its inverse.
    return (max(strength, 4.0) / BRIGHTEST) ** (1 / power) if power else 0.0


def ambient_intensity(assembly: Assembly, chosen: tuple[int, ...], exposure: float) -> Array:
    """(3,) float64: ambient lights add up before they are rounded."""
    total = np.zeros(3)
    for index in chosen:
        light = assembly.lights[index]
        if light.omnidirectional:
            total += light.uniforms(assembly.view.eye)["intensity"] * 2.0**exposure
    return total


def ambient_reflectance(material: Brdf) -> Array:
    """(3,): what it reflects of ambient light, where it asks for no texture."""
    values: dict[str, Any] = {}
    for name, value in parameter_values(material).items():
        # What does not count may be one all the same: any number stands for it.
        given = (value.factor if material.is_colour(name) else value.factor[0]) if isinstance(value, Texture) else value
        values[name] = np.asarray(given, dtype=np.float64)
    return type(material).ambient_reflectance(SimpleNamespace(**values, **material.chosen()))


def turn(material: Brdf) -> float:
    """How far the tangents, or the directions that take their place, are turned [degrees]."""
    direction = material.tangent_direction
    return direction.rotate if isinstance(direction, DirectionMap) else direction
