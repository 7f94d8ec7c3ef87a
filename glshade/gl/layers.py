"""Layers on the GPU: the parts that a film's layers are made of, each drawn once, and what follows from them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.assembly.part import Part
from glshade.image import cryptomatte
from glshade.image.image import Image
from glshade.image.layers import Layers, names_attribute
from glshade.radiance.readying import ready
from glshade.scene.scene import Film, Rate, Scene

Array = NDArray[np.float32]
Numbers = NDArray[np.int32]
Made = dict[str, Array]
# A pixel of a mask has at least this many points a side.
POINTS = 4


class Draws(Protocol):
    """What the layers ask of a Renderer."""

    @property
    def render(self) -> Callable[..., Image]:
        """Draws the picture of a scene."""

    @property
    def shown(self) -> Callable[..., Iterator[Array]]:
        """Draws a part of a scene, (H, W, 4) float32: once, or once for each offset."""


def layers(renderer: Draws, scene: Scene, dtype: str, shading: Rate | None, tile: int | None) -> Layers:
    """The picture of a scene and the layers that its film asks for. Errors: SceneError, ShaderError."""
    image = renderer.render(scene, dtype=dtype, shading=shading, tile=tile)
    if not scene.film.aovs:
        return Layers(image, {})
    maker = _Maker(renderer, scene, shading, tile)
    arrays: Made = {}
    for aov in scene.film.aovs:
        arrays |= getattr(maker, aov)()
    return Layers(image, arrays, maker.attributes)


def surfaces(renderer: Draws, scene: Scene) -> tuple[Array, Numbers]:
    """(depth (H, W), number (H, W)) at the middle of every pixel, row 0 at the top.

    depth: along the view axis [scene units], 0 where nothing is. number: of the scene's objects, which one; -1 where nothing
    is. A cut-out has holes; a blended surface counts as solid. Errors: SceneError, ShaderError.
    """
    maker = _Maker(renderer, scene, None, None)
    depth, number = maker.nearest
    of = np.array([*(one.number for one in maker.assembly.instances), -1], dtype=np.int32)
    return _single(depth), of[number]


class _Maker:
    """Makes the layers of one scene: a method each, by the layer's name."""

    def __init__(self, renderer: Draws, scene: Scene, shading: Rate | None, tile: int | None) -> None:
        self._renderer, self._scene, self._shading, self._tile = renderer, scene, shading, tile
        self.assembly = ready(scene, shading)
        self.attributes: dict[str, str] = {}

    def _draw(self, part: Part) -> Array:
        """(H, W, 4)."""
        (pixels,) = self._renderer.shown(self._scene, part, shading=self._shading, tile=self._tile)
        return pixels

    @cached_property
    def nearest(self) -> tuple[NDArray[np.float64], Numbers]:
        """depth (H, W) [scene units], and which instance (H, W), -1 for none: at the middle of each pixel."""
        pixels = self._draw(Part("depth"))
        return pixels[..., 0] / np.float64(self.assembly.unit), _which(pixels)

    def depth(self) -> Made:
        return {"depth": _single(self.nearest[0])[..., None]}

    def position(self) -> Made:
        depth, number = self.nearest
        place = positions(depth, self.assembly, self._scene.film)
        return {"position": _single(np.where((number >= 0)[..., None], place, 0.0))}

    def object_id(self) -> Made:
        names = [item.name or f"objects[{index}]" for index, item in enumerate(self._scene.objects)]
        return self._ids("object_id", [names[one.number] for one in self.assembly.instances], names)

    def material_id(self) -> Made:
        named = [one.made_of for one in self.assembly.instances]
        return self._ids("material_id", named, list(dict.fromkeys(named)))

    def _ids(self, layer: str, of: list[str], names: list[str]) -> Made:
        """The places of the instances' names among all names, counted from 1; 0 for nothing."""
        place = {name: index + 1 for index, name in enumerate(names)}
        self.attributes[f"glshade:{layer}"] = names_attribute(names)
        return {layer: np.array([*(place[name] for name in of), 0], dtype=np.float32)[self.nearest[1]][..., None]}

    @cached_property
    def _normals(self) -> NDArray[np.float64]:
        """(H, W, 3): unit, in world space."""
        normal = self._draw(Part("normal"))[..., :3].astype(np.float64)
        length = np.linalg.norm(normal, axis=2, keepdims=True)
        normal /= np.where(length > 0, length, 1.0)
        return normal

    def normal(self) -> Made:
        return {"normal": self._normals.astype(np.float32)}

    def view_normal(self) -> Made:
        return {"view_normal": (self._normals @ self.assembly.view.axes.T).astype(np.float32)}

    def uv(self) -> Made:
        return {"uv": self._draw(Part("uv"))[..., :2]}

    def albedo(self) -> Made:
        return {"albedo": self._draw(Part("albedo"))[..., :3]}

    def background(self) -> Made:
        return {"background": self._draw(Part("unlit"))[..., :3]}

    @cached_property
    def _specular(self) -> Array:
        return self._draw(Part("specular"))[..., :3]

    def specular(self) -> Made:
        return {"specular": self._specular}

    def diffuse(self) -> Made:
        # What the highlights leave, so that the two add up.
        return {"diffuse": self._draw(Part("lit"))[..., :3] - self._specular}

    def lights(self) -> Made:
        return {name: self._draw(Part("light", index))[..., :3] for index, name in enumerate(light_layers(self.assembly))}

    def cryptomatte(self) -> Made:
        points = [
            _which(pixels)
            for pixels in self._renderer.shown(
                self._scene, Part("depth"), shading=self._shading, tile=self._tile, offsets=offsets(self._scene.film)
            )
        ]
        made: Made = {}
        for layer in (cryptomatte.OBJECT, cryptomatte.MATERIAL):
            of = [one.name if layer == cryptomatte.OBJECT else one.made_of for one in self.assembly.instances]
            names = list(dict.fromkeys(of))
            place = {name: index for index, name in enumerate(names)}
            places = np.array([*(place[name] for name in of), -1], dtype=np.int32)
            pairs = cryptomatte.ranked([places[point] for point in points], names)
            self.attributes |= cryptomatte.metadata(layer, names)
            made |= {f"{layer}{i:02}": pairs[..., 4 * i : 4 * i + 4] for i in range(cryptomatte.LAYERS)}
        return made


def _which(pixels: Array) -> Numbers:
    """(H, W): the instance in each pixel of a picture of depths, -1 for none."""
    return np.where(pixels[..., 3] > 0, pixels[..., 1], -1).astype(np.int32)


def _single(value: NDArray[np.float64]) -> Array:
    """float32; what is too large for it is infinite, as in any file."""
    with np.errstate(over="ignore"):
        return value.astype(np.float32)


def offsets(film: Film) -> list[tuple[float, float]]:
    """The points of a pixel at which masks are sampled, from its middle [pixels]: the film's shifted pictures, or more."""
    n = max(POINTS, film.supersample)
    shifts = [(i + 0.5) / n - 0.5 for i in range(n)]
    return [(x, y) for y in shifts for x in shifts]


def positions(depth: NDArray[np.float64], assembly: Assembly, film: Film) -> NDArray[np.float64]:
    """(H, W, 3): the places in the world [scene units] of what is `depth` (H, W) away at the middle of each pixel."""
    view, (x, y, w, h), (width, height) = assembly.view, film.window, film.size
    across = (2 * (x + np.arange(w) + 0.5) / width - 1)[None, :] * view.half_width
    up = (1 - 2 * (y + np.arange(h) + 0.5) / height)[:, None] * view.half_height
    # Of a parallel view these are lengths, in the assembly's unit.
    spread = depth if view.perspective else np.float64(1 / assembly.unit)
    right, above, backward = view.axes
    place = (across * spread)[..., None] * right + (up * spread)[..., None] * above - depth[..., None] * backward
    result: NDArray[np.float64] = view.eye / assembly.unit + place
    return result


def light_layers(assembly: Assembly) -> list[str]:
    """A layer's name for each light: its own, or its place. Dots and the like would cut the name in two elsewhere."""
    names: list[str] = []
    for index, light in enumerate(assembly.lights):
        name = f"light_{re.sub(r'[^0-9A-Za-z_]', '_', light.name or str(index))}"
        names.append(name if name not in names else f"{name}_{index}")
    return names
