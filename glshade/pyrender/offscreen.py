"""OffscreenRenderer: pyrender's, drawn by glshade."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Mapping
from enum import IntFlag
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError, SceneError

if TYPE_CHECKING:
    from glshade.scene import Scene

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]
# pyrender's shader encodes with a power; its samples are averaged after that.
GAMMA = 2.2


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


# What is drawn with lines.
LINES = RenderFlags.FLIP_WIREFRAME | RenderFlags.ALL_WIREFRAME | RenderFlags.VERTEX_NORMALS | RenderFlags.FACE_NORMALS


class OffscreenRenderer:
    """pyrender.OffscreenRenderer's signature. backend, device: as of glshade.Renderer. Errors: ContextError.

    point_size is kept, and points are not drawn.
    """

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

        self.viewport_width = viewport_width
        self.viewport_height = viewport_height
        self.point_size = point_size
        self._renderer: Renderer | None = Renderer(backend, device)
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

        depth: along the view axis at the middle of the pixel [scene units], 0 where nothing is. seg_node_map: node -> colour,
        three numbers or one; with SEG, what is drawn and how. Errors: SceneError, GlshadeError where a flag asks for lines.
        """
        from glshade.pyrender.scene import converted, main_camera
        from glshade.scene import Film, Scene

        if self._renderer is None:
            raise GlshadeError("this OffscreenRenderer was deleted; make another")
        wanted = RenderFlags(int(flags))
        if wanted & LINES:
            names = ", ".join(str(flag.name) for flag in RenderFlags if flag & LINES & wanted)
            raise GlshadeError(f"{names}: glshade draws no lines; leave it out")
        if wanted & RenderFlags.SHADOWS_ALL:
            self._say("shadows are not local shading; they are left out")
        size = (self.viewport_width, self.viewport_height)
        seen_from = main_camera(scene, size)
        if seen_from is None:
            raise SceneError("the scene has no camera")
        colours = (seg_node_map or {}) if wanted & RenderFlags.SEG else None
        nodes = scene.mesh_nodes if colours is None else [node for node in scene.mesh_nodes if node in colours]
        flat = bool(wanted & RenderFlags.FLAT) or colours is not None or bool(wanted & RenderFlags.DEPTH_ONLY)
        objects, of = converted(scene, nodes, flat, bool(wanted & RenderFlags.SKIP_CULL_FACES))
        film = Film(size=size, samples=4, background=(0.0, 0.0, 0.0, 0.0))
        depth, number = np.zeros(size[::-1], dtype=np.float32), np.full(size[::-1], -1, dtype=np.int32)
        drawn = None
        if objects:
            drawn = Scene(objects=tuple(objects), lights=self._lights(scene, flat), camera=seen_from, film=film)
            depth, number = self._renderer.surfaces(drawn)
        if wanted & RenderFlags.DEPTH_ONLY:
            return depth
        if colours is not None:
            picture = segments(number, [colours[node] for node in of])
        else:
            picture = self._picture(drawn, np.asarray(scene.bg_color, dtype=np.float32), flat)
        return (picture if wanted & RenderFlags.RGBA else np.ascontiguousarray(picture[..., :3])), depth

    def _lights(self, scene: Any, flat: bool) -> tuple[Any, ...]:
        from glshade.lights import LIGHTS
        from glshade.pyrender.scene import lights

        return (LIGHTS["ambient"](type="ambient"),) if flat else lights(scene)

    def _picture(self, scene: Scene | None, background: Floats, flat: bool) -> Bytes:
        """(H, W, 4). As in pyrender, what covers a part of a pixel is mixed with the background after encoding."""
        assert self._renderer is not None
        if scene is None:
            pixels = np.zeros((self.viewport_height, self.viewport_width, 4), dtype=np.float32)
        else:
            pixels = self._renderer.render(scene, dtype="float32").pixels
        cover = pixels[..., 3:]
        colour = np.divide(pixels[..., :3], cover, out=np.zeros_like(pixels[..., :3]), where=cover > 0)
        colour = np.clip(colour, 0, 1)
        if not flat:
            colour **= 1 / GAMMA
        result = background * (1 - cover)
        result[..., :3] += colour * cover
        result[..., 3:] += cover
        picture: Bytes = np.rint(np.clip(result, 0, 1) * 255).astype(np.uint8)
        return picture

    def _say(self, message: str) -> None:
        """Warns once."""
        if message not in self._said:
            self._said.add(message)
            warnings.warn(message, UserWarning, stacklevel=3)

    def delete(self) -> None:
        """Gives everything back to the driver. Twice is once."""
        renderer, self._renderer = self._renderer, None
        if renderer is not None:
            renderer.release()

    def __del__(self) -> None:
        with contextlib.suppress(Exception):
            self.delete()


def segments(number: NDArray[np.int32], colours: list[Any]) -> Bytes:
    """(H, W, 4): the colour of each pixel's object, black where nothing is."""
    palette = np.zeros((len(colours) + 1, 4), dtype=np.uint8)
    palette[:, 3] = 255
    for index, colour in enumerate(colours):
        palette[index, :3] = np.clip(np.rint(np.ravel(colour)[:3]), 0, 255)
    # -1, where nothing is, finds the last.
    picture: Bytes = palette[number]
    return picture
