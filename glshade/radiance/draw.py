"""Draw: one instance as the GPU is given it, its float32 values widened to float64."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly, Instance
from glshade.assembly.values import ambient_intensity, direction, light_values, normal_matrix
from glshade.brdfs import BRDFS, Brdf
from glshade.lights import Falloff, Light
from glshade.radiance.sampler import Sampler
from glshade.scene.scene import Scene
from glshade.textures.texels import Texels, texels
from glshade.textures.texture import CHANNELS, DirectionMap, Texture

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


def draw_of(scene: Scene, assembly: Assembly, instance: Instance) -> Draw:
    """One instance as the GPU would be given it. Errors: AssetError."""
    clip = wide(assembly.view.clip_from_world(zero_to_one=True))
    return placed(scene, assembly, instance, clip, {})


def wide(value: Any) -> Array:
    """float64 of what is uploaded as float32."""
    return rounded(value).astype(np.float64)


def placed(scene: Scene, assembly: Assembly, instance: Instance, clip: Array, samplers: dict[Texels, Sampler]) -> Draw:
    """One instance under a clip matrix (4, 4). samplers: those read so far, which grow. Errors: AssetError."""
    view, material = assembly.view, instance.material
    world_from_object = instance.world_from_object.copy()
    world_from_object[:3, 3] -= view.eye
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
        parameters[name] = wide(value)
    chosen = [assembly.lights[i] for i in instance.lights]
    lamps = []
    for light in chosen:
        if not light.omnidirectional:
            uploaded = light_values(light, view.eye, scene.film.exposure)
            values = {name: value.astype(np.float64) for name, value in uploaded.items()}
            lamps.append(Lamp(type(light), getattr(light, "falloff", "none"), values))
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
        world_from_object=wide(world_from_object),
        normal_from_object=wide(normal_matrix(instance.world_from_object[:3, :3])),
        clip_from_world=clip,
        viewer=None if view.perspective else wide(view.toward_viewer),
        lamps=tuple(lamps),
        ambient=wide(ambient_intensity(assembly, instance.lights, scene.film.exposure)),
        parameters=parameters,
        samplers=textures,
        channels=channels,
        normal_map=_sampler(texels(material, bumps), samplers) if bumps else None,
        normal_scale=float(rounded(scale)),
        directions=_sampler(texels(material, "tangent_direction"), samplers) if by_map else None,
        turn=wide(direction(material)),
        alpha=float(rounded(material.alpha)),
        alpha_cutoff=float(rounded(material.alpha_cutoff)),
    )


def _sampler(given: Texels, kept: dict[Texels, Sampler]) -> Sampler:
    if given not in kept:
        kept[given] = Sampler.load(given)
    return kept[given]
