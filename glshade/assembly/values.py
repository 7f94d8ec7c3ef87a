"""Values: the numbers of materials, transforms and lights that both renderers are given."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.brdfs import Array, Brdf, parameter_values
from glshade.errors import SceneError
from glshade.lights import FALLOFFS, Falloff, Light
from glshade.optics.spectra import Spectrum
from glshade.textures.texture import DirectionMap, Texture


def direction(material: Brdf) -> Array:
    """Returns the cosine and sine (2,) of the angle by which the material turns tangents."""
    angle = math.radians(turn(material) % 360)
    return np.array([math.cos(angle), math.sin(angle)])


def normal_matrix(linear: Array) -> Array:
    """Returns the matrix (3, 3) that transforms normals, which is a multiple of the inverse transpose.

    It is the cofactor matrix divided by its largest entry. The sign of the determinant keeps the normals of mirrored objects
    on the outside.
    linear: the linear part (3, 3) of the transform of points.
    """
    # The matrix is scaled first, so that products of tiny entries such as 1e-200 do not underflow to 0. Python's numbers are
    # twenty times faster than NumPy for nine entries.
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


def normal_matrices(linear: Array) -> Array:
    """Returns the matrices (N, 3, 3) that `normal_matrix` returns for each of the matrices (N, 3, 3), to the bit."""
    scaled = linear / np.abs(linear).max(axis=(1, 2), keepdims=True)
    (a, b, c), (d, e, f), (g, h, i) = scaled.transpose(1, 2, 0)
    cofactors = np.array(
        [
            [e * i - f * h, f * g - d * i, d * h - e * g],
            [h * c - i * b, i * a - g * c, g * b - h * a],
            [b * f - c * e, c * d - a * f, a * e - b * d],
        ]
    ).transpose(2, 0, 1)
    sign = np.copysign(1.0, a * cofactors[:, 0, 0] + b * cofactors[:, 0, 1] + c * cofactors[:, 0, 2])
    result: Array = sign[:, None, None] * cofactors / np.abs(cofactors).max(axis=(1, 2), keepdims=True)
    return result


def light_values(light: Light, eye: Array, exposure: float) -> dict[str, NDArray[np.float32]]:
    """Returns the fields of a light's GLSL struct, rounded to float32.

    The intensity I is multiplied by the exposure, and for a directed light also by pi: a surface with the BRDF f reflects
    pi f cos I, where cos is the cosine between its normal and the light's direction.
    eye: position of the viewer (3,) [scene units].
    exposure: exposure of the film [stops].
    Errors: SceneError for a value that is too large for float32.
    """
    values = light.uniforms(eye)
    gain = 2.0**exposure * (1.0 if light.omnidirectional else math.pi)
    values["intensity"] = values["intensity"] * gain
    if "r_min" in values:
        # At the light's own position its strength must stay below 3e38, where float32 ends: infinity times the cosine 0 is NaN.
        strongest = float(np.abs(values["intensity"]).max())
        values["r_min"] = max(values["r_min"], least_distance(strongest, getattr(light, "falloff", "none")))
    result = {name: rounded(value) for name, value in values.items()}
    for name, value in result.items():
        if not np.isfinite(value).all():
            raise SceneError(f"lights: the {name} of {light.name or f'a {light.type} light'} is too large for float32")
    return result


# The strongest light that a light with a falloff may shed on a point, below the largest float32 of 3e38.
BRIGHTEST = 1e38


def least_distance(strength: float, falloff: Falloff) -> float:
    """Returns the distance at which light of this strength reaches BRIGHTEST [scene units]; 0 without a falloff.

    For 1/r^2 and a strength of 4 the distance is 2e-19.
    """
    power = FALLOFFS[falloff].power
    # With a strength of at least 4, distance^power is at least 4e-38: it and its inverse are normal numbers in float32.
    return (max(strength, 4.0) / BRIGHTEST) ** (1 / power) if power else 0.0


def ambient_intensity(assembly: Assembly, chosen: tuple[int, ...], exposure: float) -> Array:
    """Returns the sum (3,) of the chosen lights that are the same for every normal, in float64, with exposure.

    chosen: indices into the assembly's lights.
    exposure: exposure of the film [stops].
    """
    total = np.zeros(3)
    for index in chosen:
        light = assembly.lights[index]
        if light.ignores_normal:
            total += light.uniforms(assembly.view.eye)["intensity"] * 2.0**exposure
    return total


def ambient_reflectance(material: Brdf) -> Array:
    """Returns the share (3,) of ambient light that a material reflects, if the share does not depend on a texture."""
    values: dict[str, Any] = {}
    for name, value in parameter_values(material).items():
        # A parameter that the ambient reflectance does not use may still be a texture: its factor stands in for it.
        given = (value.factor if material.is_colour(name) else value.factor[0]) if isinstance(value, Texture) else value
        values[name] = np.asarray(given, dtype=np.float64)
    return type(material).ambient_reflectance(SimpleNamespace(**values, **material.chosen()))


def emitted(instance: Instance, exposure: float) -> NDArray[np.float32]:
    """Returns the light (3,) that an instance emits, or the factor of its emission's texture, with exposure.

    exposure: exposure of the film [stops].
    Errors: SceneError for a value that is too large for float32.
    """
    emission = instance.material.emission
    assert not isinstance(emission, Spectrum), "an assembly has RGB colours in place of spectra"
    return _exposed(instance, emission.factor if isinstance(emission, Texture) else emission, exposure)


def emitted_beside(instance: Instance, exposure: float) -> NDArray[np.float32]:
    """Returns the light (3,) that is added to the emission's texture, with exposure; 0 without a texture.

    exposure: exposure of the film [stops].
    Errors: SceneError for a value that is too large for float32.
    """
    emission = instance.material.emission
    return _exposed(instance, emission.add if isinstance(emission, Texture) else (0.0, 0.0, 0.0), exposure)


def _exposed(instance: Instance, emission: tuple[float, float, float], exposure: float) -> NDArray[np.float32]:
    result = rounded(np.array(emission) * 2.0**exposure)
    if not np.isfinite(result).all():
        raise SceneError(f"{instance.name}: emission is too large for float32")
    return result


def turn(material: Brdf) -> float:
    """Returns the angle by which tangents, or the directions of a direction map, are turned [degrees]."""
    direction = material.tangent_direction
    return direction.rotate if isinstance(direction, DirectionMap) else direction
