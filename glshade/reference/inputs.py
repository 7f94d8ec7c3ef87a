"""Inputs: the float32 values that the GPU is given, widened to float64, in the order they are drawn.

This is all that the two renderers share: vertices, indices, uniforms and texels as uploaded. What a plan leaves out because it
cannot show is not taken from the plan but from the scene, so that a plan which leaves out too much is found out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly, Instance
from glshade.assembly.part import Part
from glshade.glsl.plan import ProgramPlan, plan_instance
from glshade.radiance.draw import Draw, placed, wide
from glshade.radiance.readying import ready
from glshade.radiance.sampler import Sampler
from glshade.scene.camera import window
from glshade.scene.scene import Rate, Scene
from glshade.textures.texels import Texels

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Inputs:
    """A scene as uploaded. size: width, height [pixels]. background (4,): linear, premultiplied. draws: opaque ones first.

    window: x, y, width, height [pixels] of what is wanted of the picture; nothing else has fragments.
    """

    size: tuple[int, int]
    background: Array
    draws: tuple[Draw, ...]
    window: tuple[int, int, int, int]

    @cached_property
    def wanted(self) -> Indices:
        """(h, w): the numbers of the window's pixels in the whole picture, ascending."""
        x, y, w, h = self.window
        return np.add.outer(np.arange(y, y + h) * self.size[0], np.arange(x, x + w))


def prepare(scene: Scene, shading: Rate | None = None, part: Part | None = None) -> Inputs:
    """The values that the GPU would be given for a linear picture with one sample a pixel. part: what of the scene it shows.

    Errors: SceneError, AssetError.
    """
    assembly = ready(scene, shading, part)
    colour = scene.film.background
    alpha = colour[3] if len(colour) == 4 else 1.0
    background = wide([*(c * alpha for c in colour[:3]), alpha])
    width, height = scene.film.size
    clip = wide(window(assembly.view.clip_from_world(zero_to_one=True), (width, height), 0, 0, width, height))
    samplers: dict[Texels, Sampler] = {}
    draws = (placed(scene, assembly, instance, clip, samplers) for instance in _in_order(assembly))
    return Inputs((width, height), background, tuple(draws), scene.film.window)


def _in_order(assembly: Assembly) -> Iterator[Instance]:
    """Opaque instances, those of one program together; then blended ones, the farthest middle first."""
    by_program: dict[ProgramPlan, list[Instance]] = {}
    blended: list[tuple[float, Instance]] = []
    for instance in assembly.instances:
        if instance.material.alpha_mode == "blend":
            middle = instance.mesh.positions.mean(axis=0, dtype=np.float64)
            world = instance.world_from_object
            blended.append((float(assembly.view.depth(world[:3, 3] + world[:3, :3] @ middle)), instance))
        else:
            by_program.setdefault(plan_instance(instance, assembly, "linear"), []).append(instance)
    for instances in by_program.values():
        yield from instances
    for _, instance in sorted(blended, key=lambda item: -item[0]):
        yield instance
