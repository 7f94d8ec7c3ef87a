"""The float64 reference renderer, after the OpenGL specification and the models' papers. NumPy alone, no GL.

prepare (inputs) -> rasterise, clip (raster) -> resolve -> interpolate, texture, shade -> compose
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.part import Part
from glshade.image.image import Image
from glshade.radiance.draw import Draw
from glshade.reference.bounds import LLVMPIPE, Bounds, Driver, alphas, bounds, depth_slack, driver_of, sealed, turnable
from glshade.reference.inputs import Inputs, prepare
from glshade.reference.raster import MARGIN, Fragments, rasterise, resolve
from glshade.reference.shade import AT_CENTRE, Sampling, is_there, opacity, shade
from glshade.scene.scene import Rate, Scene

__all__ = [
    "LLVMPIPE",
    "MARGIN",
    "Bounds",
    "Draw",
    "Driver",
    "Fragments",
    "Inputs",
    "Sampling",
    "alphas",
    "bounds",
    "depth_slack",
    "driver_of",
    "is_there",
    "opacity",
    "prepare",
    "radiance",
    "rasterise",
    "render",
    "resolve",
    "sealed",
    "shade",
    "turnable",
]


def render(scene: Scene, *, shading: Rate | None = None) -> Image:
    """The picture, float32 and linear, with alpha where the background has it; one sample a pixel, whatever the film says.

    shading: overrules every object's. Errors: SceneError.
    """
    film = scene.film
    picture = radiance(scene, shading=shading)[..., : len(film.background)].astype(np.float32)
    return Image(picture, "linear", corner=film.window[:2], whole=film.size if film.crop else None)


def radiance(
    scene: Scene, *, shading: Rate | None = None, sampling: Sampling = AT_CENTRE, part: Part | None = None
) -> NDArray[Any]:
    """(H, W, 4) float64, linear Rec. 709, premultiplied, row 0 at the top; of a crop no more. Arguments and errors as for
    `render`.

    sampling: how fragments are looked at, cut-outs too; what covers a pixel, and which is nearest, is told at its centre.
    part: what of the scene is shown in place of all light.
    """
    inputs = prepare(part.scene(scene) if part else scene, shading, part)
    nearest, layers = resolve(inputs, rasterise(inputs), lambda fragments: is_there(inputs, fragments, sampling))
    width, height = inputs.size
    picture: NDArray[Any] = np.broadcast_to(inputs.background, (width * height, 4)).astype(sampling.dtype)
    picture[nearest.pixel] = shade(inputs, nearest, sampling)
    over = shade(inputs, layers, sampling)
    # Layer after layer, each over what is there: (C + (1 - alpha) D), Porter and Duff 1984.
    start = np.flatnonzero(np.append(True, layers.pixel[1:] != layers.pixel[:-1])) if len(layers) else np.empty(0, int)
    level = np.arange(len(layers)) - np.repeat(start, np.diff(np.append(start, len(layers))))
    for number in range(int(level.max(initial=-1)) + 1):
        which = np.flatnonzero(level == number)
        pixel = layers.pixel[which]
        picture[pixel] = over[which] + picture[pixel] * (1 - over[which, 3:])
    wanted: NDArray[Any] = picture[inputs.wanted]
    return wanted
