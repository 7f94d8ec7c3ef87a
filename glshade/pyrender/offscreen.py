"""OffscreenRenderer: a replacement for pyrender's class of that name, which draws with glshade."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Mapping
from enum import IntFlag
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from glshade.errors import GlshadeError, SceneError
from glshade.mesh.file import AssetWarning

if TYPE_CHECKING:
    from glshade.pyrender.painter import Painter
    from glshade.pyrender.scene import Converted


class RenderFlags(IntFlag):
    """pyrender's flags with the same numbers, so that pyrender.RenderFlags can be passed too."""

    NONE = 0
    DEPTH_ONLY = 1
    OFFSCREEN = 2
    FLIP_WIREFRAME = 4
    ALL_WIREFRAME = 8
    ALL_SOLID = 16
    SHADOWS_DIRECTIONAL = 32
    SHADOWS_POINT = 64
    SHADOWS_SPOT = 128
    SHADOWS_ALL = 32 | 64 | 128
    VERTEX_NORMALS = 256
    FACE_NORMALS = 512
    SKIP_CULL_FACES = 1024
    RGBA = 2048
    FLAT = 4096
    SEG = 8192


# Flags that pyrender obeys in its viewer, but ignores in offscreen pictures.
NORMALS = RenderFlags.VERTEX_NORMALS | RenderFlags.FACE_NORMALS
# The background of pictures that show only depth or segments.
BLACK = (0.0, 0.0, 0.0, 1.0)


class OffscreenRenderer:
    """Draws pyrender's scenes off screen, with the interface of pyrender.OffscreenRenderer."""

    def __init__(
        self,
        viewport_width: int,
        viewport_height: int,
        point_size: float = 1.0,
        *,
        backend: Any = "auto",
        device: int | None = None,
    ) -> None:
        """Creates the renderer and its OpenGL context.

        viewport_width, viewport_height: the size of the pictures [pixels].
        point_size: the side of the squares that points become [pixels].
        backend, device: the OpenGL context, as for glshade.Renderer.
        Errors: ContextError.
        """
        from glshade.gl.renderer import Renderer
        from glshade.pyrender.painter import Painter
        from glshade.pyrender.scene import Conversion

        self.viewport_width = viewport_width
        self.viewport_height = viewport_height
        self.point_size = point_size
        self._painter: Painter | None = Painter(Renderer(backend, device))
        self._conversion = Conversion()
        # The warnings that were given already.
        self._warned: set[str] = set()

    @property
    def viewport_width(self) -> int:
        """The width of the pictures [pixels]."""
        return self._viewport_width

    @viewport_width.setter
    def viewport_width(self, value: int) -> None:
        self._viewport_width = int(value)

    @property
    def viewport_height(self) -> int:
        """The height of the pictures [pixels]."""
        return self._viewport_height

    @viewport_height.setter
    def viewport_height(self, value: int) -> None:
        self._viewport_height = int(value)

    @property
    def point_size(self) -> float:
        """The side of the squares that points become [pixels]."""
        return self._point_size

    @point_size.setter
    def point_size(self, value: float) -> None:
        self._point_size = float(value)

    def render(self, scene: Any, flags: int = RenderFlags.NONE, seg_node_map: Mapping[Any, Any] | None = None) -> Any:
        """Draws a scene and returns (colour, depth), or the depth alone with DEPTH_ONLY.

        colour: (H, W, 3) uint8, or (H, W, 4) with RGBA.
        depth: (H, W) float32, the distance along the view axis, 0 where nothing is drawn [scene units]. As in pyrender, it is
            the distance at a pixel's first sample, or with SEG at the pixel's middle.

        scene: a pyrender.Scene.
        flags: RenderFlags, pyrender's or glshade's.
        seg_node_map: node -> colour, three numbers or one, from 0 to 255. With SEG only these nodes are drawn, each in its
            colour.
        Errors: SceneError; GlshadeError after `delete` or where the viewport is larger than the driver allows.
        """
        from glshade.pyrender.canvas import SAMPLES
        from glshade.pyrender.scene import AS_THEY_ARE, Look, lights, main_camera, screen

        if self._painter is None:
            raise GlshadeError("this OffscreenRenderer was deleted; create another")
        wanted = RenderFlags(int(flags))
        depth_only, segmented = RenderFlags.DEPTH_ONLY in wanted, RenderFlags.SEG in wanted
        if wanted & RenderFlags.SHADOWS_ALL and not (depth_only or segmented):
            self._warn("shadows are not local shading; they are left out")
        if wanted & NORMALS:
            self._warn("normals are drawn by pyrender's viewer alone; they are left out, as in its offscreen pictures")
        size = (self.viewport_width, self.viewport_height)
        if min(size) < 1:
            raise SceneError(f"a viewport of {size[0]} x {size[1]} pixels has no picture: both must be 1 or more")
        camera = main_camera(scene, size)
        if camera is None:
            raise SceneError("the scene has no camera")
        nodes, colours = scene.mesh_nodes, {}
        if segmented:
            colours = {node: colour_of(given) for node, given in (seg_node_map or {}).items()}
            nodes = [node for node in nodes if node in colours]
        plain = not (depth_only or segmented)
        kind: Literal["lit", "flat", "silhouette"] = "silhouette"
        if plain:
            kind = "flat" if RenderFlags.FLAT in wanted else "lit"
        look = Look(kind, RenderFlags.SKIP_CULL_FACES in wanted, colours)
        converted = self._conversion.convert(scene, nodes, look, lambda: screen(camera, size, self.point_size))
        for note in converted.notes:
            self._warn(note)
        with self._painter.renderer.context.gl as gl:
            gl.gc()
            canvas = self._painter.canvas(size, 1 if segmented else SAMPLES, not depth_only)
            canvas.begin(tuple(float(c) for c in scene.bg_color) if plain else BLACK)
            depth = np.zeros(size[::-1], dtype=np.float32)
            if converted.objects:
                wires = _wires(converted, wanted) if plain else set()
                shown_lights = lights(scene) if kind == "lit" else AS_THEY_ARE
                encoding: Literal["power", "linear"] = "power" if kind == "lit" else "linear"
                view, unit = self._painter.paint(converted.objects, wires, shown_lights, camera, canvas, encoding)
                canvas.resolve()
                depth = canvas.depth(view, unit)
            else:
                canvas.resolve()
            return depth if depth_only else (canvas.colour(4 if RenderFlags.RGBA in wanted else 3), depth)

    def _warn(self, message: str) -> None:
        """Gives a warning, unless this renderer has given the same one before."""
        if message not in self._warned:
            self._warned.add(message)
            warnings.warn(f"pyrender: {message}", AssetWarning, stacklevel=3)

    def delete(self) -> None:
        """Releases the OpenGL context with all its objects. Further calls of this method do nothing."""
        painter, self._painter = self._painter, None
        if painter is not None:
            painter.renderer.release()

    def __del__(self) -> None:
        with contextlib.suppress(Exception):
            self.delete()


def _wires(converted: Converted, wanted: RenderFlags) -> set[int]:
    """Returns the numbers of the objects that are drawn as wireframes."""
    everything = set(range(len(converted.objects)))
    if RenderFlags.ALL_WIREFRAME in wanted:
        return everything
    return everything - converted.wires if RenderFlags.FLIP_WIREFRAME in wanted else converted.wires


def colour_of(given: Any) -> tuple[float, float, float]:
    """Returns the colour, from 0 to 1, for a value of a seg_node_map.

    given: the value: three numbers from 0 to 255, or one number for all three channels.
    """
    r, g, b = (float(c) for c in np.clip(np.broadcast_to(np.ravel(given)[:3], 3) / 255, 0, 1))
    return r, g, b
