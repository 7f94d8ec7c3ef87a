"""OffscreenRenderer: pyrender's, drawn by glshade."""

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
    """pyrender's own numbers, so that either class serves."""

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


# Drawn by pyrender's viewer alone: what it reads back of an offscreen picture has none.
NORMALS = RenderFlags.VERTEX_NORMALS | RenderFlags.FACE_NORMALS
# What nothing lies behind.
NOTHING = (0.0, 0.0, 0.0, 1.0)


class OffscreenRenderer:
    """pyrender.OffscreenRenderer's signature. backend, device: as of glshade.Renderer. Errors: ContextError."""

    def __init__(
        self,
        viewport_width: int,
        viewport_height: int,
        point_size: float = 1.0,
        *,
        backend: Any = "auto",
        device: int | None = None,
    ) -> None:
        from glshade.gl.renderer import Renderer
        from glshade.pyrender.painter import Painter
        from glshade.pyrender.scene import Conversion

        self.viewport_width = viewport_width
        self.viewport_height = viewport_height
        self.point_size = point_size
        self._painter: Painter | None = Painter(Renderer(backend, device))
        self._conversion = Conversion()
        self._said: set[str] = set()

    @property
    def viewport_width(self) -> int:
        """[pixels]"""
        return self._viewport_width

    @viewport_width.setter
    def viewport_width(self, value: int) -> None:
        self._viewport_width = int(value)

    @property
    def viewport_height(self) -> int:
        """[pixels]"""
        return self._viewport_height

    @viewport_height.setter
    def viewport_height(self, value: int) -> None:
        self._viewport_height = int(value)

    @property
    def point_size(self) -> float:
        """[pixels]"""
        return self._point_size

    @point_size.setter
    def point_size(self, value: float) -> None:
        self._point_size = float(value)

    def render(self, scene: Any, flags: int = RenderFlags.NONE, seg_node_map: Mapping[Any, Any] | None = None) -> Any:
        """(colour (H, W, 3) uint8, with RGBA (H, W, 4); depth (H, W) float32), with DEPTH_ONLY the depth alone.

        depth: along the view axis [scene units], 0 where nothing is: of the pixel's first sample, with SEG at its middle, as
        in pyrender. seg_node_map: node -> colour, three numbers or one; with SEG, what is drawn and how.
        Errors: SceneError.
        """
        from glshade.pyrender.canvas import SAMPLES
        from glshade.pyrender.scene import AS_THEY_ARE, Look, lights, main_camera, screen

        if self._painter is None:
            raise GlshadeError("this OffscreenRenderer was deleted; make another")
        wanted = RenderFlags(int(flags))
        depth_only, segmented = RenderFlags.DEPTH_ONLY in wanted, RenderFlags.SEG in wanted
        if wanted & RenderFlags.SHADOWS_ALL and not (depth_only or segmented):
            self._say("shadows are not local shading; they are left out")
        if wanted & NORMALS:
            self._say("normals are drawn by pyrender's viewer alone; they are left out, as in its offscreen pictures")
        size = (self.viewport_width, self.viewport_height)
        if min(size) < 1:
            raise SceneError(f"a viewport of {size[0]} x {size[1]} pixels has no picture: both must be 1 or more")
        seen_from = main_camera(scene, size)
        if seen_from is None:
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
        found = self._conversion.convert(scene, nodes, look, lambda: screen(seen_from, size, self.point_size))
        for note in found.notes:
            self._say(note)
        with self._painter.renderer.context.gl as gl:
            gl.gc()
            canvas = self._painter.canvas(size, 1 if segmented else SAMPLES, not depth_only)
            canvas.begin(tuple(float(c) for c in scene.bg_color) if plain else NOTHING)
            depth = np.zeros(size[::-1], dtype=np.float32)
            if found.objects:
                wires = _wires(found, wanted) if plain else set()
                shining = lights(scene) if kind == "lit" else AS_THEY_ARE
                encoding: Literal["power", "linear"] = "power" if kind == "lit" else "linear"
                seen = self._painter.paint(found.objects, wires, shining, seen_from, canvas, encoding)
                canvas.resolve()
                depth = canvas.depth(*seen)
            else:
                canvas.resolve()
            return depth if depth_only else (canvas.colour(4 if RenderFlags.RGBA in wanted else 3), depth)

    def _say(self, message: str) -> None:
        """Warns once."""
        if message not in self._said:
            self._said.add(message)
            warnings.warn(f"pyrender: {message}", AssetWarning, stacklevel=3)

    def delete(self) -> None:
        """Gives everything back to the driver. Twice is once."""
        painter, self._painter = self._painter, None
        if painter is not None:
            painter.renderer.release()

    def __del__(self) -> None:
        with contextlib.suppress(Exception):
            self.delete()


def _wires(found: Converted, wanted: RenderFlags) -> set[int]:
    """The numbers of the objects that are drawn as wireframes."""
    everything = set(range(len(found.objects)))
    if RenderFlags.ALL_WIREFRAME in wanted:
        return everything
    return everything - found.wires if RenderFlags.FLIP_WIREFRAME in wanted else found.wires


def colour_of(given: Any) -> tuple[float, float, float]:
    """Of what stands in a seg_node_map: three numbers up to 255, or one for all three."""
    r, g, b = (float(c) for c in np.clip(np.broadcast_to(np.ravel(given)[:3], 3) / 255, 0, 1))
    return r, g, b
