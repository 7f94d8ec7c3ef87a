"""Surfaces: what the reference shows at a sample of the pixels of a scene's picture, and would show with a fault."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.assembly.values import ambient_intensity
from glshade.radiance.draw import Draw, Shared, placed, wide
from glshade.radiance.readying import ready
from glshade.reference.division import by_draw
from glshade.reference.inputs import Inputs, prepare
from glshade.reference.raster import Fragments, rasterise, resolve
from glshade.reference.shade import AT_CENTRE, is_there, shade_fragments
from glshade.scene.scene import Scene

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# A function that returns an instance's inputs with a fault, for the fragments that are shaded next.
Edit = Callable[[Draw, Fragments], Draw]


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The surfaces at K pixels of a scene's picture.

    scene: the scene, with one sample a pixel.
    assembly: the scene with everything looked up.
    inputs: the scene's inputs for the reference.
    pixel: (K,), the numbers of the pixels in the whole picture, ascending.
    every: all fragments of opaque surfaces that cover these pixels, hidden ones included.
    shown: the nearest fragment of each pixel that has one, ascending by pixel; also if blended surfaces lie over it.
    layered: (K,), whether blended surfaces lie over the pixel's opaque surface.
    rest: (K, 3), what the right picture shows beyond the light at the pixels' centres [linear]: a picture of several samples is
        the mean of several points of a pixel.
    """

    scene: Scene
    assembly: Assembly
    inputs: Inputs
    pixel: NDArray[np.intp]
    every: Fragments
    shown: Fragments
    layered: Flags
    rest: Array

    @cached_property
    def place(self) -> NDArray[np.intp]:
        """The positions in `pixel` of the fragments that are shown."""
        return np.searchsorted(self.pixel, self.shown.pixel)

    @cached_property
    def object(self) -> NDArray[np.intp]:
        """(K,), the index in the inputs' draws of the surface that is shown; -1 for the background."""
        result = np.full(len(self.pixel), -1, dtype=np.intp)
        result[self.place] = self.shown.draw
        return result

    def name(self, draw: int) -> str:
        """Returns the name of the object that a draw belongs to."""
        return self.inputs.draws[draw].instance.name

    def light_name(self, light: int) -> str:
        """Returns the name of a light of the assembly."""
        return self.assembly.lights[light].name or f"lights[{light}]"

    @cached_property
    def light(self) -> Array:
        """(K, 3), the light that the pixels show [linear]."""
        return self.drawn(self.shown) + self.rest

    def drawn(self, fragments: Fragments) -> Array:
        """Returns the light (K, 3) of a picture that shows these fragments, at most one for each pixel, and the background."""
        result = np.broadcast_to(self.inputs.background[:3], (len(self.pixel), 3)).copy()
        if len(fragments):
            result[np.searchsorted(self.pixel, fragments.pixel)] = shade_fragments(self.inputs, fragments)[:, :3]
        return result

    def with_edit(self, edit: Edit) -> Array:
        """Returns the light (K, 3) that the pixels would show with a fault of the shading."""
        result = self.light.copy()
        for number, which, part in self._by_draw():
            right = self.inputs.draws[number]
            draw = edit(right, part)
            if draw is not right:
                # No fault of the shading moves a vertex, so that their positions need not be computed again.
                draw.__dict__.setdefault("clip", right.clip)
                at = self.place[which]
                result[at] = shade(self.inputs, number, draw, part) + self.rest[at]
        return result

    def subset(self, which: NDArray[np.intp]) -> Surfaces:
        """Returns the surfaces at some of the pixels, given by their positions (N,) in `pixel`, ascending."""
        pixel = self.pixel[which]
        return replace(
            self,
            pixel=pixel,
            every=Fragments.none(),
            shown=self.shown.take(np.isin(self.shown.pixel, pixel)),
            layered=self.layered[which],
            rest=self.rest[which],
        )

    def nearest(self, kept: Flags, key: Array | None = None) -> Array:
        """Returns the light (K, 3) of a picture of some of the fragments `every`.

        kept: which of them are drawn.
        key: optional; of a pixel's fragments, the one with the largest key is shown, in place of the nearest one.
        """
        fragments = self.every.take(kept)
        order = np.lexsort((-(fragments.depth if key is None else key[kept]), fragments.pixel))
        first = np.ones(len(order), dtype=np.bool_)
        first[1:] = fragments.pixel[order[1:]] != fragments.pixel[order[:-1]]
        light = self.drawn(fragments.take(order[first]))
        same = (light + self.rest == self.light).all(axis=1)
        return np.where(same[:, None], self.light, light)

    def parts(self) -> tuple[Array, Array]:
        """Returns (all light, specular light), an array (L + 1, K, 3) each.

        The first L rows hold the light that each of the L lights adds to the K pixels. The last row holds the emission.
        """
        lights = len(self.assembly.lights)
        every, specular = (np.zeros((lights + 1, len(self.pixel), 3)) for _ in range(2))
        for number, which, part in self._by_draw():
            draw, at = self.inputs.draws[number], self.place[which]
            shiny = self._specular(draw)
            if draw.instance.material.emits:
                every[lights, at] = shade(self.inputs, number, _unlit(draw), part)
            for light in draw.instance.lights:
                alone = self._lit_by(draw, light)
                every[light, at] = shade(self.inputs, number, alone, part)
                if shiny is not None and alone.lamps:
                    specular[light, at] = shade(self.inputs, number, self._lit_by(shiny, light), part)
        return every, specular

    def _lit_by(self, draw: Draw, light: int) -> Draw:
        """Returns a draw with one of its lights only, an index in the assembly's lights, and without emission."""
        kinds, dark = self.assembly.lights, np.zeros(3)
        if draw.shares:
            shares = tuple(self._lit_by(share, light) for share in draw.shares if light in share.instance.lights)
            # Without any share, the draw is dark.
            return replace(draw, shares=shares or (replace(_unlit(draw), emission=dark),))
        draw = replace(draw, emission=dark, added={**draw.added, "emission": dark})
        if kinds[light].ignores_normal:
            ambient = wide(ambient_intensity(self.assembly, (light,), self.scene.film.exposure))
            return replace(draw, lamps=(), surrounds=(), ambient=ambient)
        alike = [
            i
            for i in draw.instance.lights
            if not kinds[i].ignores_normal and kinds[i].omnidirectional == kinds[light].omnidirectional
        ]
        number = alike.index(light)
        if kinds[light].omnidirectional:
            return replace(draw, lamps=(), surrounds=(draw.surrounds[number],), ambient=dark)
        return replace(draw, lamps=(draw.lamps[number],), surrounds=(), ambient=dark)

    def _specular(self, draw: Draw) -> Draw | None:
        """Returns a draw without its diffuse lobes; None where nothing is left."""
        pairs = [(share, share.material.specular_part()) for share in draw.instance.shares]
        shares = [replace(share, material=shiny) for share, shiny in pairs if shiny is not None]
        material = draw.instance.material.specular_part()
        if material is None or (draw.instance.shares and not shares):
            return None
        instance = replace(draw.instance, material=material, shares=tuple(shares))
        return placed(self.scene, self.assembly, instance, draw.clip_from_world, Shared())

    def _by_draw(self) -> Iterator[tuple[int, Any, Fragments]]:
        """Yields (index of a draw, indices of its fragments among those that are shown, these fragments)."""
        for draw, which, part in by_draw(self.inputs, self.shown):
            yield self.inputs.draws.index(draw), which, part


def _unlit(draw: Draw) -> Draw:
    """Returns a draw without its lights, which shows what it emits. Of its shares, the first one emits."""
    return replace(draw.shares[0] if draw.shares else draw, lamps=(), surrounds=(), ambient=np.zeros(3))


def shade(inputs: Inputs, number: int, draw: Draw, fragments: Fragments) -> Array:
    """Returns the light (N, 3) of fragments of the draw of this number, with `draw` in its place."""
    draws = (*inputs.draws[:number], draw, *inputs.draws[number + 1 :])
    return shade_fragments(replace(inputs, draws=draws), fragments)[:, :3]


def surfaces_at(scene: Scene, pixel: NDArray[np.intp], truth: Array) -> Surfaces:
    """Returns the surfaces at pixels (K,) of the film's window, given by their numbers in it, ascending.

    scene: a scene with one sample a pixel.
    truth: (K, 3), the right picture at these pixels, which may have several samples [linear].
    Errors: SceneError.
    """
    assembly = ready(scene)
    inputs = prepare(scene)
    numbers = inputs.wanted.reshape(-1)[pixel]
    wanted = np.zeros(inputs.size[0] * inputs.size[1], dtype=np.bool_)
    wanted[numbers] = True
    modes = np.array([draw.alpha_mode for draw in inputs.draws])
    found = [part.take(wanted[part.pixel]) for part in rasterise(inputs)]
    shown, layers = resolve(inputs, found, lambda fragments: is_there(inputs, fragments, AT_CENTRE))
    every = Fragments.joined(found)
    every = every.take((modes[every.draw] != "blend") & every.covered & (every.depth > 0))
    every = every.take(is_there(inputs, every))
    layered = np.isin(numbers, layers.pixel)
    centres = Surfaces(scene, assembly, inputs, numbers, every, shown, layered, np.zeros((len(numbers), 3)))
    return replace(centres, rest=truth - centres.light)
