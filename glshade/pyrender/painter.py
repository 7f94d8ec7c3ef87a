"""Painter: draws objects that were pyrender's, as pyrender does: in one pass, encoded as it is shown, depth included."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from glshade.arrays import rounded
from glshade.assembly.assembly import Assembly
from glshade.errors import SceneError
from glshade.gl.renderer import Draw, Prepared, Renderer
from glshade.glsl.generator import PAGE
from glshade.pyrender.canvas import Canvas
from glshade.scene.camera import View
from glshade.scene.scene import Film, Object, Scene

if TYPE_CHECKING:
    from glshade.lights import Light

# Scenes that stay at hand, ready to draw: one for each of a few flags, or a few in turn.
KEPT_SCENES = 8


@dataclass(eq=False)
class Ready:
    """A scene made ready to draw, the right way up."""

    scene: Scene
    encoding: str
    assembly: Assembly
    draws: list[Draw]


class Painter:
    """Keeps what it has made ready and what it draws into for the next picture."""

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        self._ready: list[Ready] = []
        self._canvases: dict[tuple[int, bool], Canvas] = {}

    def paint(
        self,
        objects: list[Object],
        wires: set[int],
        lights: tuple[Light, ...],
        camera: Any,
        canvas: Canvas,
        encoding: Literal["power", "linear"],
    ) -> tuple[View, float]:
        """Draws into a canvas that has begun; wires: the numbers of the objects that are drawn as wireframes.

        The view, and what its lengths are to be multiplied by. The renderer's context is current. Errors: SceneError.
        """
        ready = self._made_ready(objects, lights, camera, canvas.size, encoding)
        view = ready.assembly.view
        clip = rounded(view.clip_from_world(self.renderer.context.zero_to_one) * UPRIGHT)
        gl = self.renderer.context.gl

        def draw(draws: Iterable[Draw]) -> None:
            for as_wires, some in groupby(draws, lambda one: one.instance.number in wires):
                gl.wireframe = as_wires
                self.renderer._draw_all(Prepared(ready.scene, ready.assembly, list(some)), clip)
            gl.wireframe = False

        draw(ready.draws)
        # What can be seen through counts as solid in the depth.
        blended = [one for one in ready.draws if one.plan.alpha == "blend"]
        if blended:
            with canvas.without_colours():
                draw(replace(one, plan=replace(one.plan, alpha="opaque")) for one in blended)
        # Scenes of extreme size are drawn in another unit of length.
        return view, camera.near / view.near if camera.near else 1.0

    def canvas(self, size: tuple[int, int], samples: int, coloured: bool) -> Canvas:
        """The canvas of that many samples a pixel. Errors: GlshadeError where it is too large."""
        found = self._canvases.get((samples, coloured))
        if found is None or found.size != size:
            # Not released: what is forgotten is collected, and moderngl stumbles over what is both.
            found = self._canvases[samples, coloured] = Canvas(self.renderer.context, size, samples, coloured)
        return found

    def _made_ready(
        self, objects: list[Object], lights: tuple[Light, ...], camera: Any, size: tuple[int, int], encoding: str
    ) -> Ready:
        """The scene of these objects, ready to draw: the same as before where nothing has changed."""
        for index, known in enumerate(self._ready):
            scene = known.scene
            same = len(scene.objects) == len(objects) and all(map(operator.is_, scene.objects, objects))
            if same and (scene.lights, scene.camera, scene.film.size, known.encoding) == (lights, camera, size, encoding):
                self._ready.append(self._ready.pop(index))
                return known
        # Every part has been validated: for many objects, once more is as long as drawing them.
        scene = Scene.model_construct(objects=tuple(objects), lights=lights, camera=camera, film=Film(size=size))
        # "power" is none of a film's encodings, and all the same to the renderer.
        shown: Any = encoding
        prepared = self.renderer._prepare(scene, None, shown)
        if any(draw.added for draw in prepared.draws):
            raise SceneError(f"more than {PAGE} lights of a kind: glshade.render(glshade.from_pyrender(scene)) draws them")
        made = Ready(scene, encoding, prepared.assembly, list(map(_upright, prepared.draws)))
        self._ready = [*self._ready[1 - KEPT_SCENES :], made]
        return made


# glshade draws pictures upside down, so that row 0 is the top; the samples of a pixel then lie otherwise than in pyrender.
UPRIGHT = np.array([[1.0], [-1.0], [1.0], [1.0]])


def _upright(draw: Draw) -> Draw:
    """The draw with its front faces the other way round."""
    instance = replace(draw.instance)
    vars(instance)["mirrored"] = not draw.instance.mirrored
    return replace(draw, instance=instance)
