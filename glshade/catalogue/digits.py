"""Digits: the digits that models, materials and scenes lose in float32, line by line of their GLSL."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, numbers
from glshade.glsl.shaders import Shaders, current
from glshade.radiance.draw import Draw
from glshade.radiance.readying import ready
from glshade.radiance.surface import Surface, at_vertices
from glshade.reference.inputs import prepare
from glshade.reference.raster import Fragments, rasterise, resolve
from glshade.reference.shade import AT_CENTRE, is_there, surface_at
from glshade.scene.scene import Scene
from glshade.spirv.digits import Digits, joined, measure_digits
from glshade.spirv.model import model_text
from glshade.spirv.ranges import directions, parameters, variants
from glshade.spirv.surface import Program, part_of, surface_text

Array = NDArray[Any]

# The default number of inputs at which a model is run. With 8,192, a line that is bad in one of a thousand inputs is found
# several times, and a model takes about a second.
COUNT = 8192


def digits_of_model(model: type[Brdf], count: int = COUNT, seed: int = 1, shaders: Shaders | None = None) -> Digits:
    """Returns the digits that a model loses, over the ranges that it declares and with every combination of its options.

    count: the number of random directions and parameters, shared by the combinations.
    Errors: ShaderError, MissingLibrary.
    """
    random = np.random.default_rng(seed)
    materials = list(variants(model))
    share = math.ceil(count / len(materials))
    return joined(_measured(one, parameters(one, share, random), share, random, shaders, seed) for one in materials)


def digits_of_material(material: Brdf, count: int = COUNT, seed: int = 1, shaders: Shaders | None = None) -> Digits:
    """Returns the digits that a material loses at random directions.

    Errors: ShaderError, MissingLibrary; ValueError for a parameter that is a texture.
    """
    return _measured(material, numbers(material), count, np.random.default_rng(seed), shaders, seed)


def _measured(
    material: Brdf, values: Mapping[str, Any], count: int, random: np.random.Generator, shaders: Shaders | None, seed: int
) -> Digits:
    text = model_text(material, shaders)
    l, v = directions(count, random)
    inputs = {"a_l": l, "a_v": v, **{f"u_{name}": value for name, value in values.items()}}
    return measure_digits(
        lambda given, arithmetic: text.run(given, count, arithmetic), inputs, text.stage, seed, ("a_l", "a_v")
    )


def digits_of_scene(scene: Scene, count: int = COUNT, seed: int = 1, shaders: Shaders | None = None) -> Digits:
    """Returns the digits that the programs of a scene lose at the pixels of its picture.

    count: the number of pixels at which the programs are run, spread evenly over those of each instance.
    Errors: SceneError, ShaderError, MissingLibrary.
    """
    shown = list(_shown(scene, shaders))
    pixels = sum(len(part.pixels) for part in shown)
    found = []
    for part in shown:
        wanted = math.ceil(count * len(part.pixels) / pixels)
        chosen = np.unique(part.points[np.linspace(0, len(part.pixels) - 1, wanted).astype(np.intp)])
        found += [program.digits(part_of(part.surface, chosen), seed) for program in part.programs]
    return joined(found)


def errors_of_scene(scene: Scene, seed: int = 1, shaders: Shaders | None = None) -> Array:
    """Returns the largest relative error of each pixel (H, W) with all lines rounded; 0 for the background.

    The pixels of instances that are shaded per vertex have the largest error of their triangle.
    Errors: SceneError, ShaderError, MissingLibrary.
    """
    inputs = prepare(scene)
    errors = np.zeros(inputs.size[0] * inputs.size[1])
    for part in _shown(scene, shaders):
        for program in part.programs:
            of_pixels = program.errors(part.surface, seed)[part.points].max(axis=1)
            errors[part.pixels] = np.maximum(errors[part.pixels], of_pixels)
    return errors[inputs.wanted]


@dataclass(frozen=True, eq=False)
class _Shown:
    """What a picture shows of an instance.

    programs: the programs that shade it.
    surface: the points (N,) at which they are run.
    pixels: (M,), the numbers of the pixels that show it.
    points: (M, K), the points whose light each of these pixels shows.
    """

    programs: tuple[Program, ...]
    surface: Surface
    pixels: NDArray[np.intp]
    points: NDArray[np.intp]


def _shown(scene: Scene, shaders: Shaders | None) -> Iterator[_Shown]:
    """Yields what a picture shows of each instance. Errors: SceneError, ShaderError, MissingLibrary."""
    inputs, assembly = prepare(scene), ready(scene)
    nearest, _ = resolve(inputs, rasterise(inputs), lambda fragments: is_there(inputs, fragments, AT_CENTRE))
    for number, draw in enumerate(inputs.draws):
        fragments = nearest.take(nearest.draw == number)
        if len(fragments):
            surface, points = _shaded_points(draw, fragments, inputs.size)
            yield _Shown(surface_text(scene, assembly, draw, shaders or current()).programs, surface, fragments.pixel, points)


def _shaded_points(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> tuple[Surface, NDArray[np.intp]]:
    """Returns the points at which a draw is shaded, and the points (N, K) that each of its fragments shows."""
    if draw.instance.rate == "phong":
        surface = surface_at(draw, fragments, size, AT_CENTRE)
        side = np.where(fragments.front | (not draw.instance.back_faces), 1.0, -1.0)
        return replace(surface, side=side), np.arange(len(fragments))[:, None]
    if draw.instance.rate == "gouraud":
        vertices, points = np.unique(draw.triangles[fragments.triangle], return_inverse=True)
        return at_vertices(draw, vertices, np.float64), points.reshape(-1, 3)
    faces, points = np.unique(fragments.triangle, return_inverse=True)
    return at_vertices(draw, draw.triangles[faces, 2], np.float64, centroids=True), points[:, None]
