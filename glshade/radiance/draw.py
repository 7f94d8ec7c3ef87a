"""Draw: the inputs of one instance, with the float32 values of the GPU widened to float64."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly
from glshade.assembly.instance import Instance
from glshade.assembly.values import ambient_intensity, direction, emitted, emitted_beside, light_values, normal_matrix
from glshade.brdfs import BRDFS, Brdf
from glshade.lights import Falloff, Light
from glshade.radiance.sampler import Sampler
from glshade.scene.scene import Scene
from glshade.textures.texels import Texels, placement_of, texels_of
from glshade.textures.texture import CHANNELS, DirectionMap, Texture
from glshade.textures.volume import Volume

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Lamp:
    """A light with the values that are uploaded.

    kind: the class of the light.
    falloff: how its strength decreases with distance, as a key of FALLOFFS.
    values: the fields of its GLSL struct, widened to float64. The intensity includes the exposure and, for a directed light,
        the factor pi; positions are relative to the eye.
    """

    kind: type[Light]
    falloff: Falloff
    values: dict[str, Array]

    def fields(self, dtype: Any) -> SimpleNamespace:
        """Returns the fields of the GLSL struct as attributes of an object, as arrays of the given NumPy type."""
        return SimpleNamespace(**{name: value.astype(dtype) for name, value in self.values.items()})


@dataclass(frozen=True, eq=False)
class Shared:
    """What several instances of a scene have in common, and is computed once.

    samplers: the textures that have been read already.
    lamps: index of a light in the assembly -> the light with the values that are uploaded.
    """

    samplers: dict[Texels, Sampler] = field(default_factory=dict)
    lamps: dict[int, Lamp] = field(default_factory=dict)


class Text(Protocol):
    """The GLSL of a draw's programs, which takes the place of the Python functions of the model and the lights."""

    def __call__(self, surface: Any) -> NDArray[Any]:
        """Returns the light (N, 3) of the points of a Surface."""

    def with_samplers(self, change: Callable[[Sampler], Sampler]) -> Text:
        """Returns the text with a function applied to each texture that it reads."""

    def with_tables(self, change: Callable[[Volume], Volume]) -> Text:
        """Returns the text with a function applied to each table that it reads."""


@dataclass(frozen=True, eq=False)
class Draw:
    """The inputs of one instance, as the GPU is given them.

    instance: the instance that is drawn.
    triangles: vertex indices (T, 3), in the order of drawing.
    world_from_object: transform (4, 4) from object space to positions relative to the eye.
    normal_from_object: transform (3, 3) of normals.
    clip_from_world: clip matrix (4, 4), with y pointing down, reversed depth, and z in [0, w].
    viewer: unit direction to the viewer (3,) in an orthographic view; None in a perspective view.
    lamps: the directed lights.
    surrounds: the omnidirectional lights that depend on the normal.
    ambient: sum (3,) of the intensities of those lights that are the same for every normal, multiplied by the exposure.
    emission: light (3,) that the surface emits, or the factor of the emission's texture, multiplied by the exposure.
    occlusion: strength of the occlusion map; without a map it has no effect.
    parameters: name -> value of the model's parameter, (3,) for a colour, () for a number; the factor of a textured parameter.
    added: name -> number that is added to the texels of a textured parameter and of "emission", (3,) or ().
    samplers: name -> texture of a textured parameter, of "emission" and of "occlusion".
    channels: name -> channel that holds a textured parameter or the occlusion, 0 to 3; colours ignore it.
    normal_map: texture of normals, from a normal map or from a bump map; None without either.
    normal_scale: factor of the map's x and y.
    directions: texture of the directions of tangents; None without a direction map.
    turn: cosine and sine (2,) of the angle by which tangents are turned.
    alpha: the material's alpha, which the alpha of the base texture and of vertex colours multiplies.
    alpha_cutoff: least alpha that is drawn, if the alpha mode is "mask".
    data: name -> table that the model reads, and what the model adds to its tables.
    shares: the draws of the instance's shares, whose light is added; empty for an instance without shares.
    weights: matrix (3, 3) that turns the light of three bands of wavelengths into RGB; None for RGB colours.
    text: optional; computes the light of points in place of the Python functions of the model and the lights.
    """

    instance: Instance
    triangles: Indices
    world_from_object: Array
    normal_from_object: Array
    clip_from_world: Array
    viewer: Array | None
    lamps: tuple[Lamp, ...]
    surrounds: tuple[Lamp, ...]
    ambient: Array
    emission: Array
    occlusion: float
    parameters: dict[str, Array]
    added: dict[str, Array]
    samplers: dict[str, Sampler]
    channels: dict[str, int]
    normal_map: Sampler | None
    normal_scale: float
    directions: Sampler | None
    turn: Array
    alpha: float
    alpha_cutoff: float
    data: dict[str, Any] = field(default_factory=dict)
    shares: tuple[Draw, ...] = ()
    weights: Array | None = None
    text: Text | None = None

    def with_samplers(self, change: Callable[[Sampler], Sampler]) -> Draw:
        """Returns the draw with a function applied to each texture of its parameters, and to those of its shares."""
        changed = {name: change(sampler) for name, sampler in self.samplers.items()}
        shares = tuple(share.with_samplers(change) for share in self.shares)
        return replace(self, samplers=changed, shares=shares, text=self.text.with_samplers(change) if self.text else None)

    def sampler(self, key: str) -> Sampler:
        """Returns the texture that the material has under a key. Errors: KeyError if the draw reads no texture of this key."""
        maps = {"normal_map": self.normal_map, "bump_map": self.normal_map, "tangent_direction": self.directions}
        return maps.get(key) or self.samplers[key]

    def with_tables(self, change: Callable[[Volume], Volume]) -> Draw:
        """Returns the draw with a function applied to each table that its model reads, and to those of its shares."""
        data = {name: change(value) if isinstance(value, Volume) else value for name, value in self.data.items()}
        shares = tuple(share.with_tables(change) for share in self.shares)
        return replace(self, data=data, shares=shares, text=self.text.with_tables(change) if self.text else None)

    @property
    def back_faces(self) -> bool:
        """Whether back faces are drawn."""
        return self.instance.back_faces

    @property
    def model(self) -> type[Brdf]:
        """The reflectance model."""
        return BRDFS[self.instance.material.brdf]

    @property
    def alpha_mode(self) -> Literal["opaque", "mask", "blend"]:
        """The material's alpha mode."""
        return self.instance.material.alpha_mode

    @property
    def alpha_sampler(self) -> Sampler | None:
        """The texture of the base colour, whose alpha is used; None if the base colour has no texture."""
        return next((self.samplers.get(name) for name, p in self.model.parameters().items() if p.base), None)

    @property
    def tables(self) -> tuple[Volume, ...]:
        """The different tables that the model reads, and those of the shares."""
        read = (value for part in (self, *self.shares) for value in part.data.values() if isinstance(value, Volume))
        return tuple({table.digest: table for table in read}.values())

    @property
    def tangents(self) -> bool:
        """Whether the shading frame follows the mesh's tangents."""
        return self.model.anisotropic or self.normal_map is not None

    @property
    def pictures(self) -> list[Sampler]:
        """All textures of the instance."""
        maps = [sampler for sampler in (self.normal_map, self.directions) if sampler is not None]
        return [*self.samplers.values(), *maps]

    @property
    def grids(self) -> tuple[tuple[Any, ...] | None, ...]:
        """The different `Sampler.grid` of the textures; just None where all textures have the same one."""
        found = {sampler.grid for part in (self, *self.shares) for sampler in part.pictures}
        return tuple(sorted(found, key=str)) if len(found) > 1 else (None,)

    @cached_property
    def clip(self) -> Array:
        """The positions of the vertices in clip space (V, 4)."""
        world = self.instance.mesh.positions @ self.world_from_object[:3, :3].T + self.world_from_object[:3, 3]
        clip: Array = world @ self.clip_from_world[:, :3].T + self.clip_from_world[:, 3]
        return clip

    @cached_property
    def identities(self) -> NDArray[Any]:
        """Rows (V, C) that are equal for vertices at the same position, whatever their other attributes are."""
        # The sum makes 0 of -0, which is the same position.
        result: NDArray[Any] = self.instance.mesh.positions + 0.0
        return result

    @cached_property
    def world_terms(self) -> Array:
        """The sums (V, 3) of the absolute values of the terms that make up the vertices' positions relative to the eye.

        Float32 sums are rounded relative to their terms.
        """
        matrix = np.abs(self.world_from_object)
        result: Array = np.abs(self.instance.mesh.positions) @ matrix[:3, :3].T + matrix[:3, 3]
        return result

    @cached_property
    def clip_terms(self) -> Array:
        """The sums (V, 4) of the absolute values of the terms that make up the vertices' positions in clip space."""
        matrix = np.abs(self.clip_from_world)
        result: Array = self.world_terms @ matrix[:, :3].T + matrix[:, 3]
        return result


def draw_of(scene: Scene, assembly: Assembly, instance: Instance) -> Draw:
    """Returns the inputs of one instance, with the clip matrix of the whole picture. Errors: AssetError."""
    clip = wide(assembly.view.clip_from_world(zero_to_one=True))
    return placed(scene, assembly, instance, clip, Shared())


def wide(value: Any) -> Array:
    """Returns a value rounded to float32, as for the upload, and widened to float64 again."""
    return rounded(value).astype(np.float64)


def placed(scene: Scene, assembly: Assembly, instance: Instance, clip: Array, shared: Shared) -> Draw:
    """Returns the inputs of one instance.

    clip: clip matrix (4, 4), as in `Draw.clip_from_world`.
    shared: textures and lights that are known already; those that are read here are added.
    Errors: AssetError.
    """
    view, material, samplers = assembly.view, instance.material, shared.samplers
    world_from_object = instance.world_from_object.copy()
    world_from_object[:3, 3] -= view.eye
    parameters, textures, channels = {}, {}, {}
    added: dict[str, Array] = {"emission": emitted_beside(instance, scene.film.exposure).astype(np.float64)}
    for name, declared in type(material).parameters().items():
        value, key = getattr(material, name), name
        if value is None and declared.same_as is not None:
            key = declared.same_as
            value = getattr(material, key)
        if isinstance(value, Texture):
            textures[name] = _sampler(material, key, samplers)
            channels[name] = CHANNELS.index(value.channel or CHANNELS[0])
            added[name] = wide(value.add if type(material).is_colour(name) else value.add[0])
            value = value.factor if type(material).is_colour(name) else value.factor[0]
        parameters[name] = wide(value)
    if isinstance(material.emission, Texture) and material.emits:
        textures["emission"] = _sampler(material, "emission", samplers)
    chosen = [assembly.lights[i] for i in instance.lights]
    if material.occlusion is not None and any(light.omnidirectional for light in chosen):
        textures["occlusion"] = _sampler(material, "occlusion", samplers)
        channels["occlusion"] = CHANNELS.index(material.occlusion.channel)
    lamps: list[Lamp] = []
    surrounds: list[Lamp] = []
    for index, light in zip(instance.lights, chosen, strict=True):
        if not light.ignores_normal:
            if index not in shared.lamps:
                shared.lamps[index] = _lamp(light, view.eye, scene.film.exposure)
            (surrounds if light.omnidirectional else lamps).append(shared.lamps[index])
    if instance.shares:
        shares = tuple(placed(scene, assembly, part, clip, shared) for part in instance.parts)
    else:
        shares = ()
    triangles = instance.mesh.triangles.astype(np.intp)
    if material.alpha_mode == "blend":
        # Blended triangles are drawn back to front.
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
        surrounds=tuple(surrounds),
        ambient=wide(ambient_intensity(assembly, instance.lights, scene.film.exposure)),
        emission=emitted(instance, scene.film.exposure).astype(np.float64),
        occlusion=float(rounded(material.occlusion.strength)) if material.occlusion else 0.0,
        parameters=parameters,
        added=added,
        samplers=textures,
        channels=channels,
        normal_map=_sampler(material, bumps, samplers) if bumps else None,
        normal_scale=float(rounded(scale)),
        directions=_sampler(material, "tangent_direction", samplers) if by_map else None,
        turn=wide(direction(material)),
        alpha=float(rounded(material.alpha)),
        alpha_cutoff=float(rounded(material.alpha_cutoff)),
        data=material.data() if lamps else {},
        shares=shares,
        weights=None if instance.weights is None else wide(instance.weights),
    )


def _lamp(light: Light, eye: Array, exposure: float) -> Lamp:
    """Returns a light with the values that are uploaded. eye: position of the viewer (3,) [scene units]. exposure: [stops]."""
    values = {name: value.astype(np.float64) for name, value in light_values(light, eye, exposure).items()}
    return Lamp(type(light), getattr(light, "falloff", "none"), values)


def _sampler(material: Brdf, key: str, samplers: dict[Texels, Sampler]) -> Sampler:
    """Returns the texture that a material has under a key. Its texels are read once and then kept in `samplers`.

    Errors: AssetError.
    """
    texels = texels_of(material, key)
    if texels not in samplers:
        samplers[texels] = Sampler.load(texels)
    return samplers[texels].placed(placement_of(material, key))
