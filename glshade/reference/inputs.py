"""Inputs: the float32 values that the GPU renderer uploads, widened to float64, in drawing order.

The two renderers share nothing but these values: vertices, indices, uniforms and texels. The values are taken from the scene
and not from the plan of a GPU program (glshade/glsl/plan.py). If a plan wrongly leaves out a visible feature, the two pictures
therefore differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.assembly.part import Part
from glshade.calibration.calibration import Calibration
from glshade.glsl.batch import batches
from glshade.glsl.planner import plans
from glshade.radiance.draw import Draw, Shared, placed, wide
from glshade.radiance.readying import ready
from glshade.radiance.sampler import Sampler
from glshade.scene.camera import window
from glshade.scene.object import Rate
from glshade.scene.scene import Scene

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Inputs:
    """A scene with the values that the GPU renderer uploads.

    size: width and height of the whole picture [pixels].
    background: the background (4,), linear and premultiplied.
    draws: the instances with their values: opaque ones first, then blended ones from back to front.
    window: x, y, width and height [pixels] of the part of the picture that is rendered.
    clip_from_world: the matrix (4, 4) from positions relative to the eye to clip space, before it is rounded.
    extent: half the side of the square round a pixel's centre in which the pixel has its samples [pixels]. It is 0 for one
        sample a pixel, which lies at the centre; of several samples, only the driver knows the places.
    calibration: how the picture is seen.
    """

    size: tuple[int, int]
    background: Array
    draws: tuple[Draw, ...]
    window: tuple[int, int, int, int]
    clip_from_world: Array
    extent: float
    calibration: Calibration

    @cached_property
    def wanted(self) -> Indices:
        """The numbers (h, w) of the window's pixels in the whole picture, row by row."""
        x, y, w, h = self.window
        return np.add.outer(np.arange(y, y + h) * self.size[0], np.arange(x, x + w))

    def decoded(self, values: Sequence[float], error: float) -> Inputs:
        """Returns the values with the textures as a driver reads them. values, error: as for `Sampler.decoded`."""
        known: dict[int, Sampler] = {}

        def read(sampler: Sampler) -> Sampler:
            # Several draws share a sampler, and go on sharing it.
            if id(sampler) not in known:
                known[id(sampler)] = sampler.decoded(values, error)
            return known[id(sampler)]

        draws = (draw.with_samplers(read) for draw in self.draws)
        return replace(self, draws=tuple(draws))

    def shifted(self, right: float, down: float) -> Inputs:
        """Returns the values for a picture whose pixels lie farther to the right and farther down [pixels]."""
        clip = wide(window(self.clip_from_world, self.size, right, down, *self.size))
        return replace(self, draws=tuple(replace(draw, clip_from_world=clip) for draw in self.draws))


def prepare(scene: Scene, shading: Rate | None = None, part: Part | None = None) -> Inputs:
    """Returns the values that the GPU renderer uploads for a linear picture that is not shifted within its pixels.

    scene: the scene to draw.
    shading: optional; replaces the shading rate of every object.
    part: optional; the part of the scene's light, or the property of its surfaces, that is shown.
    Errors: SceneError, AssetError.
    """
    assembly = ready(scene, shading, part)
    colour = scene.film.background
    alpha = colour[3] if len(colour) == 4 else 1.0
    background = wide([*(c * alpha for c in colour[:3]), alpha])
    width, height = scene.film.size
    whole = assembly.view.clip_from_world(zero_to_one=True)
    clip = wide(window(whole, (width, height), 0, 0, width, height))
    shared = Shared()
    draws = (placed(scene, assembly, instance, clip, shared) for instance in _in_order(assembly, scene.film.exposure))
    extent = 0.5 if scene.film.samples > 1 else 0.0
    calibration = assembly.calibration(scene)
    return Inputs((width, height), background, tuple(draws), scene.film.window, whole, extent, calibration)


def _in_order(assembly: Assembly, exposure: float) -> Iterator[Instance]:
    """Opaque instances grouped by program, then blended ones by the mean of their vertices, the farthest first.

    The order is that of the GPU renderer: it matters where depths are equal and where surfaces are blended.
    """
    first = assembly.first_parts()
    whole = {id(part): instance for part, instance in zip(first.instances, assembly.instances, strict=True)}
    for batch in batches(first, plans(first, "linear"), exposure):
        yield from (whole[id(part)] for part in batch.instances)
    blended: list[tuple[float, Instance]] = []
    for instance in assembly.instances:
        if instance.material.alpha_mode == "blend":
            middle = instance.mesh.positions.mean(axis=0, dtype=np.float64)
            world = instance.world_from_object
            blended.append((float(assembly.view.depth(world[:3, 3] + world[:3, :3] @ middle)), instance))
    for _, instance in sorted(blended, key=lambda item: -item[0]):
        yield instance
