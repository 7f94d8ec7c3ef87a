"""Layers: draws the layers that a film asks for, from a few parts of the scene that are drawn once each."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.assembly.illumination import wavelengths_of
from glshade.assembly.part import Part
from glshade.gl.tiles import Offset, shifts
from glshade.image import cryptomatte
from glshade.image.image import Image
from glshade.image.layers import SPECTRAL_ATTRIBUTES, Layers, names_attribute, spectral_name
from glshade.radiance.readying import ready
from glshade.scene import labels
from glshade.scene.film import Film
from glshade.scene.object import Rate
from glshade.scene.scene import Scene

Array = NDArray[np.float32]
Numbers = NDArray[np.int32]
# Layer name -> pixels (H, W, channels).
Arrays = dict[str, Array]
# A mask is sampled at a grid of points in each pixel, with at least this many points along each axis.
POINTS = 4


class Draws(Protocol):
    """The methods of a Renderer that the layers need."""

    @property
    def render(self) -> Callable[..., Image]:
        """Draws the picture of a scene."""

    @property
    def draw_part(self) -> Callable[..., Iterator[Array]]:
        """Draws a part of a scene as pictures (H, W, 4) float32: one picture, or one for each offset."""


def draw_layers(renderer: Draws, scene: Scene, dtype: str, shading: Rate | None, tile: int | None) -> Layers:
    """Returns the picture of a scene and the layers that its film asks for.

    renderer: the renderer that draws.
    scene: the scene to draw.
    dtype: uint8 or float32, the type of the picture.
    shading: optional; replaces the shading rate of every object.
    tile: optional; the largest side that is drawn in one piece [pixels].
    Errors: SceneError, ShaderError.
    """
    image = renderer.render(scene, dtype=dtype, shading=shading, tile=tile)
    if not scene.film.aovs:
        return Layers(image, {})
    maker = _Maker(renderer, scene, shading, tile)
    arrays: Arrays = {}
    for aov in scene.film.aovs:
        arrays |= getattr(maker, aov)()
    film = scene.film
    return Layers(image, arrays, maker.attributes, film.aov_format, film.depth_scale, maker.legends)


def surfaces(renderer: Draws, scene: Scene) -> tuple[Array, Numbers]:
    """Returns (depth (H, W), number (H, W)) of the nearest surface at the centre of every pixel, row 0 at the top.

    depth is measured along the view axis [scene units], and is 0 where there is no surface. number is the index of the object
    in the scene, -1 where there is no surface. Cut-outs have holes; blended surfaces count as opaque.
    Errors: SceneError, ShaderError.
    """
    maker = _Maker(renderer, scene, None, None)
    depth, instance = maker.nearest
    objects = np.array([*(each.number for each in maker.assembly.instances), -1], dtype=np.int32)
    return _float32(depth), objects[instance]


class _Maker:
    """Makes the layers of one scene. Each layer has a method of its name, which returns the arrays to save.

    assembly: the assembled scene.
    attributes: the attributes to save with the layers; the methods add to them.
    """

    def __init__(self, renderer: Draws, scene: Scene, shading: Rate | None, tile: int | None) -> None:
        self._renderer, self._scene, self._shading, self._tile = renderer, scene, shading, tile
        self.assembly = ready(scene, shading)
        self.attributes: dict[str, str] = {}
        self.legends: dict[str, dict[int, Any]] = {}

    def _draw(self, part: Part) -> Array:
        """Returns the pixels (H, W, 4) of a part of the scene."""
        (pixels,) = self._renderer.draw_part(self._scene, part, shading=self._shading, tile=self._tile)
        return pixels

    @cached_property
    def nearest(self) -> tuple[NDArray[np.float64], Numbers]:
        """(depth (H, W) [scene units], index of the instance (H, W)) at the centre of each pixel; -1 where no surface is."""
        pixels = self._draw(Part("depth"))
        return pixels[..., 0] / np.float64(self.assembly.unit), _instances(pixels)

    def depth(self) -> Arrays:
        return {"depth": _float32(self.nearest[0])[..., None]}

    def position(self) -> Arrays:
        depth, instance = self.nearest
        place = positions(depth, self.assembly, self._scene.film)
        return {"position": _float32(np.where((instance >= 0)[..., None], place, 0.0))}

    def object_id(self) -> Arrays:
        names, categories = labels.names(self._scene), labels.object_categories(self._scene)
        layer = self._ids("object_id", [names[instance.number] for instance in self.assembly.instances], names)
        materials: dict[int, dict[str, None]] = {}
        for instance in self.assembly.instances:
            materials.setdefault(instance.number, {})[instance.made_of] = None
        self.legends["object_id"] = {
            number + 1: {"name": names[number], "category": categories[number], "materials": list(made_of)}
            for number, made_of in sorted(materials.items())
        }
        return layer

    def material_id(self) -> Arrays:
        materials = [instance.made_of for instance in self.assembly.instances]
        return self._ids("material_id", materials, list(dict.fromkeys(materials)))

    def semantic_id(self) -> Arrays:
        categories = labels.object_categories(self._scene)
        names = [categories[instance.number] for instance in self.assembly.instances]
        return self._ids("semantic_id", names, labels.categories(self._scene))

    def mask(self) -> Arrays:
        return {"mask": (self.nearest[1] >= 0).astype(np.float32)[..., None]}

    def _ids(self, layer: str, instance_names: list[str], names: list[str]) -> Arrays:
        """Returns a layer of numbers: each pixel has the position (from 1) of its instance's name in `names`, or 0 for none."""
        ids = {name: index + 1 for index, name in enumerate(names)}
        self.attributes[f"glshade:{layer}"] = names_attribute(names)
        self.legends[layer] = {number: {"name": name} for name, number in ids.items()}
        values = np.array([*(ids[name] for name in instance_names), 0], dtype=np.float32)
        return {layer: values[self.nearest[1]][..., None]}

    @cached_property
    def _normals(self) -> NDArray[np.float64]:
        """The unit normals (H, W, 3) in world space; 0 where there is no surface."""
        normal = self._draw(Part("normal"))[..., :3].astype(np.float64)
        length = np.linalg.norm(normal, axis=2, keepdims=True)
        normal /= np.where(length > 0, length, 1.0)
        return normal

    def normal(self) -> Arrays:
        return {"normal": self._normals.astype(np.float32)}

    def view_normal(self) -> Arrays:
        return {"view_normal": (self._normals @ self.assembly.view.axes.T).astype(np.float32)}

    def uv(self) -> Arrays:
        return {"uv": self._draw(Part("uv"))[..., :2]}

    def albedo(self) -> Arrays:
        return {"albedo": self._draw(Part("albedo"))[..., :3]}

    def spectrum(self) -> Arrays:
        arrays: Arrays = {}
        self.attributes |= SPECTRAL_ATTRIBUTES
        wavelengths = wavelengths_of(self._scene.film.bands)
        for first in range(0, len(wavelengths), 3):
            pixels = self._draw(Part("spectrum", first))
            arrays |= {
                spectral_name(wavelength): pixels[..., [channel]]
                for channel, wavelength in enumerate(wavelengths[first : first + 3])
            }
        return arrays

    def background(self) -> Arrays:
        return {"background": self._draw(Part("dark"))[..., :3]}

    @cached_property
    def _specular(self) -> Array:
        return self._draw(Part("specular"))[..., :3]

    def specular(self) -> Arrays:
        return {"specular": self._specular}

    def diffuse(self) -> Arrays:
        # The difference makes the layers add up exactly to the light that is drawn.
        reflected = self._draw(Part("lit"))[..., :3] - self._specular
        return {"diffuse": reflected if self._emission is None else reflected - self._emission}

    @cached_property
    def _emission(self) -> Array | None:
        """The light (H, W, 3) that surfaces emit or, if unlit, show; None if there is none."""
        materials = [instance.material for instance in self.assembly.instances]
        if not any(material.emits or material.unlit for material in materials):
            return None
        return self._draw(Part("emission"))[..., :3]

    def emission(self) -> Arrays:
        width, height = self._scene.film.window[2:]
        return {"emission": np.zeros((height, width, 3), np.float32) if self._emission is None else self._emission}

    def lights(self) -> Arrays:
        return {name: self._draw(Part("light", index))[..., :3] for index, name in enumerate(light_layers(self.assembly))}

    def cryptomatte(self) -> Arrays:
        points = [
            _instances(pixels)
            for pixels in self._renderer.draw_part(
                self._scene, Part("depth"), shading=self._shading, tile=self._tile, offsets=mask_points(self._scene.film)
            )
        ]
        instances = self.assembly.instances
        arrays: Arrays = {}
        for layer in (cryptomatte.OBJECT, cryptomatte.MATERIAL):
            instance_names = [each.name if layer == cryptomatte.OBJECT else each.made_of for each in instances]
            names = list(dict.fromkeys(instance_names))
            index_of = {name: index for index, name in enumerate(names)}
            indices = np.array([*(index_of[name] for name in instance_names), -1], dtype=np.int32)
            pairs = cryptomatte.ranked([indices[point] for point in points], names)
            self.attributes |= cryptomatte.metadata(layer, names)
            arrays |= {f"{layer}{i:02}": pairs[..., 4 * i : 4 * i + 4] for i in range(cryptomatte.LAYERS)}
        return arrays


def _instances(pixels: Array) -> Numbers:
    """Returns the index (H, W) of the instance in each pixel of a picture of depths; -1 where there is no surface."""
    return np.where(pixels[..., 3] > 0, pixels[..., 1], -1).astype(np.int32)


def _float32(value: NDArray[np.float64]) -> Array:
    """Returns the values in float32. Those beyond its range become infinite, as they would in a file."""
    with np.errstate(over="ignore"):
        return value.astype(np.float32)


def mask_points(film: Film) -> list[Offset]:
    """Returns the points of a pixel at which masks are sampled, as offsets from its centre: an even grid, at least as fine as
    the picture's supersampling."""
    return shifts(max(POINTS, film.supersample))


def positions(depth: NDArray[np.float64], assembly: Assembly, film: Film) -> NDArray[np.float64]:
    """Returns the positions (H, W, 3) in the world [scene units] of the points that are seen at the centres of the pixels.

    depth: the depths (H, W) of these points along the view axis [scene units].
    assembly: the assembled scene.
    film: the scene's film.
    """
    view, (x, y, w, h), (width, height) = assembly.view, film.window, film.size
    across = (2 * (x + np.arange(w) + 0.5) / width - 1 - view.centre[0])[None, :] * view.half_width
    up = (1 - 2 * (y + np.arange(h) + 0.5) / height - view.centre[1])[:, None] * view.half_height
    # In a parallel view, half_width and half_height are lengths in the assembly's unit, and depth does not spread the rays.
    spread = depth if view.perspective else np.float64(1 / assembly.unit)
    right, above, backward = view.axes
    place = (across * spread)[..., None] * right + (up * spread)[..., None] * above - depth[..., None] * backward
    result: NDArray[np.float64] = view.eye / assembly.unit + place
    return result


def light_layers(assembly: Assembly) -> list[str]:
    """Returns the name of the layer of each of the scene's lights: `light_` with the light's name or index.

    Characters that are not letters, digits or _ are replaced, because EXR files separate layers and channels by dots.
    """
    names: list[str] = []
    for index, light in enumerate(assembly.lights[: assembly.own_light]):
        name = f"light_{re.sub(r'[^0-9A-Za-z_]', '_', light.name or str(index))}"
        names.append(name if name not in names else f"{name}_{index}")
    return names
