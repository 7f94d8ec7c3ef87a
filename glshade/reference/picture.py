"""Picture: a scene drawn by the float64 reference."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import group_starts
from glshade.assembly.part import Part
from glshade.image.image import Image
from glshade.reference.inputs import Inputs, prepare
from glshade.reference.raster import rasterise, resolve
from glshade.reference.shade import AT_CENTRE, Sampling, is_there, shade_fragments
from glshade.scene.object import Rate
from glshade.scene.scene import Scene


def render(scene: Scene, *, shading: Rate | None = None) -> Image:
    """Returns the picture of a scene, float32 and linear, with alpha if the background has it.

    It has one sample per pixel, whatever the film asks for.
    scene: the scene to draw.
    shading: optional; replaces the shading rate of every object.
    Errors: SceneError.
    """
    film = scene.film
    inputs = prepare(scene, shading)
    picture = _shown(inputs, AT_CENTRE)[..., : len(film.background)].astype(np.float32)
    whole = film.size if film.crop else None
    return Image(picture, "linear", corner=film.window[:2], whole=whole, calibration=inputs.calibration)


def radiance(
    scene: Scene,
    *,
    shading: Rate | None = None,
    sampling: Sampling = AT_CENTRE,
    part: Part | None = None,
    offset: tuple[float, float] = (0.0, 0.0),
) -> NDArray[Any]:
    """Returns the pixels (H, W, 4) of the film's window, float64, linear Rec. 709, premultiplied, row 0 at the top.

    scene: the scene to draw.
    shading: optional; replaces the shading rate of every object.
    sampling: where and how precisely fragments are shaded and cut out. Coverage and depth are always tested at the centre.
    part: optional; the part of the scene's light, or the property of its surfaces, that is shown.
    offset: the distance (right, down) by which all pixels are shifted, for the mean of several pictures [pixels].
    Errors: SceneError.
    """
    inputs = prepare(part.scene(scene) if part else scene, shading, part).decoded(sampling.decoded, 0.0)
    return _shown(inputs.shifted(*offset), sampling)


def _shown(inputs: Inputs, sampling: Sampling) -> NDArray[Any]:
    """Returns the pixels (H, W, 4), as `radiance` does."""
    nearest, layers = resolve(inputs, rasterise(inputs), lambda fragments: is_there(inputs, fragments, sampling))
    width, height = inputs.size
    picture: NDArray[Any] = np.broadcast_to(inputs.background, (width * height, 4)).astype(sampling.dtype)
    picture[nearest.pixel] = shade_fragments(inputs, nearest, sampling)
    over = shade_fragments(inputs, layers, sampling)
    # The n-th blended fragments of all pixels are blended at once, by the operator "over" (Porter and Duff 1984): a fragment of
    # premultiplied colour C changes a pixel of colour D to C + (1 - alpha) D.
    start = group_starts(layers.pixel)
    order = np.arange(len(layers)) - np.repeat(start, np.diff(np.append(start, len(layers))))
    for number in range(int(order.max(initial=-1)) + 1):
        selected = np.flatnonzero(order == number)
        pixel = layers.pixel[selected]
        picture[pixel] = over[selected] + picture[pixel] * (1 - over[selected, 3:])
    wanted: NDArray[Any] = picture[inputs.wanted]
    return wanted
