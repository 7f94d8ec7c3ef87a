"""Digits: the digits that models, materials and scenes lose in float32, line by line of their GLSL."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, numbers
from glshade.glsl.shaders import Shaders, current
from glshade.radiance.readying import ready
from glshade.radiance.surface import part_of
from glshade.reference.inputs import prepare
from glshade.reference.visible import VisiblePart, visible_parts
from glshade.scene.scene import Scene
from glshade.spirv.digits import Digits, joined, measure_digits
from glshade.spirv.model import model_text
from glshade.spirv.ranges import directions, parameters, variants
from glshade.spirv.surface import Program, surface_text

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
    pixels = sum(len(part.pixel) for part, _ in shown)
    found = []
    for part, programs in shown:
        wanted = math.ceil(count * len(part.pixel) / pixels)
        chosen = np.unique(part.point[np.linspace(0, len(part.pixel) - 1, wanted).astype(np.intp)])
        found += [program.digits(part_of(part.surface, chosen), seed) for program in programs]
    return joined(found)


def errors_of_scene(scene: Scene, seed: int = 1, shaders: Shaders | None = None) -> Array:
    """Returns the largest relative error of each pixel (H, W) with all lines rounded; 0 for the background.

    The pixels of instances that are shaded per vertex have the error of the nearest corner of their triangle.
    Errors: SceneError, ShaderError, MissingLibrary.
    """
    inputs = prepare(scene)
    errors = np.zeros(inputs.size[0] * inputs.size[1])
    for part, programs in _shown(scene, shaders):
        for program in programs:
            errors[part.pixel] = np.maximum(errors[part.pixel], program.errors(part.surface, seed)[part.point])
    return errors[inputs.wanted]


def _shown(scene: Scene, shaders: Shaders | None) -> Iterator[tuple[VisiblePart, tuple[Program, ...]]]:
    """Yields what a picture shows of each instance, and the programs that shade it.

    Errors: SceneError, ShaderError, MissingLibrary.
    """
    assembly = ready(scene)
    for part in visible_parts(prepare(scene)):
        yield part, surface_text(scene, assembly, part.draw, shaders or current()).programs
