"""Painter: draws objects as pyrender does, in one pass that blends encoded colours and writes depth."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from glshade.arrays import rounded
from glshade.errors import SceneError
from glshade.gl.preparation import DrawCall, Prepared
from glshade.gl.renderer import Renderer
from glshade.glsl.plan import PAGE
from glshade.pyrender.canvas import Canvas
from glshade.scene.camera import View
from glshade.scene.film import Film
from glshade.scene.object import Object
from glshade.scene.scene import Scene

if TYPE_CHECKING:
    from glshade.lights import Light

# The number of prepared scenes in the cache: enough for one scene with several flags, or for several scenes in turn.
KEPT_SCENES = 8


@dataclass(eq=False)
class Ready:
    """A scene that is ready to draw.

    encoding: the encoding of the colours that the scene's programs write.
    prepared: the scene, prepared by the renderer.
    calls: the scene's draw calls, changed for a picture that is drawn the right way up.
    """

    encoding: str
    prepared: Prepared
    calls: list[DrawCall]


class Painter:
    """Draws objects, and caches prepared scenes and framebuffers for the next picture.

    renderer: the Renderer whose context and programs are used.
    """

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
        point_size: float = 1.0,
    ) -> tuple[View, float]:
        """Draws objects into a canvas and returns (view, the length of the view's unit [scene units]).

        The renderer's context has to be current, and the canvas bound by `begin`.

        objects: glshade's objects to draw, in drawing order.
        wires: the numbers of the objects that are drawn as wireframes.
        lights: glshade's lights that fall on the objects.
        camera: glshade's camera that sees the objects.
        canvas: the framebuffer to draw into.
        encoding: "power" encodes colours with a power of 1 / 2.2 as pyrender does, "linear" leaves them as they are.
        point_size: the side of the squares that points become [pixels].
        Errors: SceneError.
        """
        # The canvas averages samples by itself, so that the film needs none. A supersampled film does not move the squares of
        # points to the edges of pixels. model_copy does not refuse the sizes of points that pyrender allows.
        film = Film(size=canvas.size).model_copy(update={"point_size": point_size, "supersample": 2})
        ready = self._prepared(objects, lights, camera, film, encoding)
        view = ready.prepared.assembly.view
        # glshade's own pictures are upside down already, as the picture of a flipped camera has to be.
        turn = 1.0 if getattr(camera, "flipped", False) else UPRIGHT
        clip = rounded(view.clip_from_world(self.renderer.context.zero_to_one) * turn)
        gl = self.renderer.context.gl

        def draw(calls: Iterable[DrawCall]) -> None:
            for as_wires, group in groupby(calls, lambda call: call.instance.number in wires):
                gl.wireframe = as_wires
                self.renderer.draw(ready.prepared, clip, group)
            gl.wireframe = False

        draw(ready.calls)
        # pyrender writes the depth of blended surfaces, but glshade does not. So these surfaces are drawn a second time, as
        # opaque ones and only into the depth.
        blended = [call for call in ready.calls if call.plan.alpha == "blend"]
        if blended:
            with canvas.without_colours():
                draw(replace(call, plan=replace(call.plan, alpha="opaque")) for call in blended)
        # The ratio of the near planes is the length of the view's unit: the renderer changes the unit for scenes of extreme
        # size.
        return view, next((own / seen for own, seen in ((camera.near, view.near), (camera.far, view.far)) if own), 1.0)

    def canvas(self, size: tuple[int, int], samples: int, coloured: bool) -> Canvas:
        """Returns a canvas, the cached one if it has the right size. Errors: GlshadeError if the size is too large.

        size: width, height [pixels].
        samples, coloured: as for Canvas.
        """
        canvas = self._canvases.get((samples, coloured))
        if canvas is None or canvas.size != size:
            # Do not release the old canvas: gc() frees it once the last reference goes, and moderngl fails if both happen.
            canvas = self._canvases[samples, coloured] = Canvas(self.renderer.context, size, samples, coloured)
        return canvas

    def _prepared(self, objects: list[Object], lights: tuple[Light, ...], camera: Any, film: Film, encoding: str) -> Ready:
        """Returns the scene of these objects, ready to draw. It comes from the cache if none of its parts has changed."""
        # model_construct skips validation: all parts are valid, and validating many objects takes as long as drawing them.
        scene = Scene.model_construct(objects=tuple(objects), lights=lights, camera=camera, film=film)
        for index, known in reversed(list(enumerate(self._ready))):
            before = known.prepared.scene
            same = len(before.objects) == len(objects) and all(map(operator.is_, before.objects, objects))
            if same and (before.lights, before.film, known.encoding) == (lights, film, encoding):
                if before.camera == camera:
                    self._ready.append(self._ready.pop(index))
                    return known
                # The renderer prepares nothing but the view of a scene that shares all values with an earlier one.
                scene = before.through(camera)
                break
        # The renderer accepts "power" too, but a film has no such encoding, so its type does not name it.
        any_encoding: Any = encoding
        prepared = self.renderer.prepare(scene, None, any_encoding)
        if any(call.added for call in prepared.calls):
            raise SceneError(f"more than {PAGE} lights of a kind: glshade.render(glshade.from_pyrender(scene)) draws them")
        calls = prepared.calls if getattr(camera, "flipped", False) else list(map(_upright, prepared.calls))
        ready = Ready(encoding, prepared, calls)
        self._ready = [*self._ready[1 - KEPT_SCENES :], ready]
        return ready


# A factor of clip-space coordinates that turns pictures the right way up. glshade draws its own pictures upside down, so that
# row 0 of an array is the top. In a picture drawn upside down, the samples of a pixel would be at other places than in
# pyrender.
UPRIGHT = np.array([[1.0], [-1.0], [1.0], [1.0]])


def _upright(call: DrawCall) -> DrawCall:
    """Returns the draw call with the opposite winding of front faces, which turning the picture reverses."""
    return replace(call, mirrored=not call.mirrored)
