"""Inputs: the float32 values that the GPU is given, widened to float64, in the order they are drawn.

This is all that the two renderers share: vertices, indices, uniforms and texels as uploaded. What a plan leaves out because it
cannot show is not taken from the plan but from the scene, so that a plan which leaves out too much is found out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.assembly import Assembly, Instance, assemble
from glshade.brdfs import BRDFS, Brdf
from glshade.camera import window
from glshade.lights import Falloff, Light
from glshade.part import Part
from glshade.plan import ProgramPlan, plan_instance
from glshade.reference.texturing import Sampler
from glshade.scene import Rate, Scene
from glshade.texels import Texels, texels
from glshade.texture import CHANNELS, DirectionMap, Texture
from glshade.uniforms import ambient_intensity, direction, light_values, normal_matrix, object_uniforms, rounded

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Lamp:
    """A light as uploaded. values: its struct's fields, intensity with exposure and pi; positions relative to the eye."""

    kind: type[Light]
    falloff: Falloff
    values: dict[str, Array]

    def fields(self, dtype: Any) -> SimpleNamespace:
        """The struct in another precision."""
        return SimpleNamespace(**{name: value.astype(dtype) for name, value in self.values.items()})


@dataclass(frozen=True, eq=False)
class Draw:
    """One instance as the GPU is given it.

    triangles (T, 3): vertex numbers in the order of drawing. world_from_object (4, 4): to positions relative to the eye.
    normal_from_object (3, 3). clip_from_world (4, 4), y downward, depth reversed, z in [0, w]. viewer (3,): v of an
    orthographic view, None in perspective. parameters: name -> (3,) or (), a texture's factor; samplers: their textures, by
    the same names; channels: of those that are numbers, 0 to 3. normal_map: a bump map's normals too. directions: of tangents,
    by a map; turn (2,): cos and sin of the angle by which they are turned. ambient (3,). alpha: what the base texture's and the
    vertex colours' alpha multiply.
    """

    instance: Instance
    triangles: Indices
    world_from_object: Array
    normal_from_object: Array
    clip_from_world: Array
    viewer: Array | None
    lamps: tuple[Lamp, ...]
    ambient: Array
    parameters: dict[str, Array]
    samplers: dict[str, Sampler]
    channels: dict[str, int]
    normal_map: Sampler | None
    normal_scale: float
    directions: Sampler | None
    turn: Array
    alpha: float
    alpha_cutoff: float

    @property
    def model(self) -> type[Brdf]:
        """The reflectance model."""
        return BRDFS[self.instance.material.brdf]

    @property
    def alpha_mode(self) -> Literal["opaque", "mask", "blend"]:
        """What alpha does."""
        return self.instance.material.alpha_mode

    @property
    def alpha_sampler(self) -> Sampler | None:
        """The texture whose alpha counts: the surface's own colour's."""
        return next((self.samplers.get(name) for name, p in self.model.parameters().items() if p.base), None)

    @property
    def tangents(self) -> bool:
        """Whether the shading frame is turned by the mesh's tangents."""
        return self.model.anisotropic or self.normal_map is not None

    @property
    def pictures(self) -> list[Sampler]:
        """All that is read at texture coordinates."""
        return [*self.samplers.values(), *(s for s in (self.normal_map, self.directions) if s is not None)]

    @cached_property
    def clip(self) -> Array:
        """(V, 4): the vertices in clip space."""
        world = self.instance.mesh.positions @ self.world_from_object[:3, :3].T + self.world_from_object[:3, 3]
        clip: Array = world @ self.clip_from_world[:, :3].T + self.clip_from_world[:, 3]
        return clip


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
    assembly = assemble(scene, shading)
    assembly = part.of(assembly) if part else assembly
    colour = scene.film.background
    alpha = colour[3] if len(colour) == 4 else 1.0
    background = _wide([*(c * alpha for c in colour[:3]), alpha])
    width, height = scene.film.size
    clip = _wide(window(assembly.view.clip_from_world(zero_to_one=True), (width, height), 0, 0, width, height))
    samplers: dict[Texels, Sampler] = {}
    draws = (_draw(scene, assembly, plan, instance, clip, samplers) for plan, instance in _in_order(assembly))
    return Inputs((width, height), background, tuple(draws), scene.film.window)


def draw_of(scene: Scene, assembly: Assembly, instance: Instance) -> Draw:
    """One instance as the GPU would be given it. Errors: AssetError."""
    clip = _wide(assembly.view.clip_from_world(zero_to_one=True))
    return _draw(scene, assembly, plan_instance(instance, assembly, "linear"), instance, clip, {})


def _wide(value: Any) -> Array:
    """float64 of what is uploaded as float32."""
    return rounded(value).astype(np.float64)


def _in_order(assembly: Assembly) -> Iterator[tuple[ProgramPlan, Instance]]:
    """Opaque instances, those of one program together; then blended ones, the farthest middle first."""
    by_program: dict[ProgramPlan, list[Instance]] = {}
    blended: list[tuple[float, ProgramPlan, Instance]] = []
    for instance in assembly.instances:
        plan = plan_instance(instance, assembly, "linear")
        if instance.material.alpha_mode == "blend":
            middle = instance.mesh.positions.mean(axis=0, dtype=np.float64)
            world = instance.world_from_object
            blended.append((float(assembly.view.depth(world[:3, 3] + world[:3, :3] @ middle)), plan, instance))
        else:
            by_program.setdefault(plan, []).append(instance)
    for plan, instances in by_program.items():
        for instance in instances:
            yield plan, instance
    for _, plan, instance in sorted(blended, key=lambda item: -item[0]):
        yield plan, instance


def _draw(
    scene: Scene, assembly: Assembly, plan: ProgramPlan, instance: Instance, clip: Array, samplers: dict[Texels, Sampler]
) -> Draw:
    view, material = assembly.view, instance.material
    uploaded = object_uniforms(plan, instance, view.eye)
    normal = uploaded.get("u_normal_from_object")
    parameters, textures, channels = {}, {}, {}
    for name, declared in type(material).parameters().items():
        value, place = getattr(material, name), name
        if value is None and declared.same_as is not None:
            place = declared.same_as
            value = getattr(material, place)
        if isinstance(value, Texture):
            textures[name] = _sampler(texels(material, place), samplers)
            channels[name] = CHANNELS.index(value.channel or CHANNELS[0])
            value = value.factor if type(material).is_colour(name) else value.factor[0]
        parameters[name] = _wide(value)
    chosen = [assembly.lights[i] for i in instance.lights]
    lamps = []
    for light in chosen:
        if not light.omnidirectional:
            values = light_values(light, view.eye, scene.film.exposure)
            wide = {name: value.astype(np.float64) for name, value in values.items()}
            lamps.append(Lamp(type(light), getattr(light, "falloff", "none"), wide))
    triangles = instance.mesh.triangles.astype(np.intp)
    if material.alpha_mode == "blend":
        centroids = instance.mesh.positions[triangles].mean(axis=1, dtype=np.float64)
        world = centroids @ instance.world_from_object[:3, :3].T + instance.world_from_object[:3, 3]
        triangles = triangles[np.argsort(-view.depth(world), kind="stable")]
    bumps, scale = ("normal_map", material.normal_map.scale) if material.normal_map else (None, 1.0)
    if material.bump_map:
        bumps, scale = "bump_map", material.bump_map.height
    by_map = isinstance(material.tangent_direction, DirectionMap)
    return Draw(
        instance=instance,
        triangles=triangles,
        world_from_object=_wide(uploaded["u_world_from_object"]),
        normal_from_object=_wide(normal_matrix(instance.world_from_object[:3, :3]) if normal is None else normal),
        clip_from_world=clip,
        viewer=None if view.perspective else _wide(view.toward_viewer),
        lamps=tuple(lamps),
        ambient=_wide(ambient_intensity(assembly, instance.lights, scene.film.exposure)),
        parameters=parameters,
        samplers=textures,
        channels=channels,
        normal_map=_sampler(texels(material, bumps), samplers) if bumps else None,
        normal_scale=float(rounded(scale)),
        directions=_sampler(texels(material, "tangent_direction"), samplers) if by_map else None,
        turn=_wide(direction(material)),
        alpha=float(rounded(material.alpha)),
        alpha_cutoff=float(rounded(material.alpha_cutoff)),
    )


def _sampler(given: Texels, kept: dict[Texels, Sampler]) -> Sampler:
    if given not in kept:
        kept[given] = Sampler.load(given)
    return kept[given]
