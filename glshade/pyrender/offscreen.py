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


# pyrender's users replace its shaders through `_renderer._program_cache`, most of them to draw normals or triangles.
NO_SHADERS = (
    "glshade has no pyrender shaders to replace (_renderer._program_cache): call normals(scene) for world normals, "
    "faces(scene) for triangles, or render(scene, RenderFlags.SEG, ...) for segments"
)
CROWDED = "the scene has more than four lights of a kind, so pictures are brighter than pyrender's; most_lights=4 is its rule"


class OffscreenRenderer:
    """Draws pyrender's scenes off screen, with the interface of pyrender.OffscreenRenderer."""

    def __init__(
        self,
        viewport_width: int,
        viewport_height: int,
        point_size: float = 1.0,
        *,
        samples: int = 4,
        most_lights: int | None = None,
        backend: Any = "auto",
        device: int | None = None,
    ) -> None:
        """Creates the renderer and its OpenGL context.

        viewport_width, viewport_height: the size of the pictures [pixels].
        point_size: the side of the squares that points become [pixels].
        samples: the number of samples in a pixel, at most as many as the driver has; pyrender has 4.
        most_lights: the number of lights of a kind that light an object, those nearest to it; 4 is pyrender's own rule. None
            uses all lights.
        backend, device: the OpenGL context, as for glshade.Renderer.
        Errors: ContextError; GlshadeError where `samples` or `most_lights` is less than 1.
        """
        from glshade.gl.renderer import Renderer
        from glshade.pyrender.painter import Painter
        from glshade.pyrender.scene import Conversion

        self._samples, self._most_lights = _counted("samples", samples), most_lights
        if most_lights is not None:
            _counted("most_lights", most_lights)
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
        from glshade.pyrender.scene import AS_THEY_ARE, Look, crowded, lights, screen

        painter, size, camera = self._begin(scene)
        wanted = RenderFlags(int(flags))
        depth_only, segmented = RenderFlags.DEPTH_ONLY in wanted, RenderFlags.SEG in wanted
        if wanted & RenderFlags.SHADOWS_ALL and not (depth_only or segmented):
            self._warn("shadows are not local shading; they are left out")
        if wanted & NORMALS:
            self._warn("normals are drawn by pyrender's viewer alone; they are left out, as in its offscreen pictures")
        nodes, colours = scene.mesh_nodes, {}
        if segmented:
            colours = {node: colour_of(given) for node, given in (seg_node_map or {}).items()}
            nodes = [node for node in nodes if node in colours]
        plain = not (depth_only or segmented)
        kind: Literal["lit", "flat", "silhouette"] = "silhouette"
        if plain:
            kind = "flat" if RenderFlags.FLAT in wanted else "lit"
        look = Look(kind, RenderFlags.SKIP_CULL_FACES in wanted, colours, kind == "lit" and self._most_lights is not None, True)
        converted = self._conversion.convert(scene, nodes, look, lambda: screen(camera, size))
        for note in converted.notes:
            self._warn(note)
        if kind == "lit" and self._most_lights is None and crowded(scene):
            self._warn(CROWDED)
        with painter.renderer.context.gl as gl:
            gl.gc()
            canvas = painter.canvas(size, 1 if segmented else self._samples, not depth_only)
            canvas.begin(tuple(float(c) for c in scene.bg_color) if plain else BLACK)
            depth = np.zeros(size[::-1], dtype=np.float32)
            if converted.objects:
                wires = _wires(converted, wanted) if plain else set()
                shown_lights = lights(scene, self._most_lights) if kind == "lit" else AS_THEY_ARE
                encoding: Literal["power", "linear"] = "power" if kind == "lit" else "linear"
                view, unit = painter.paint(converted.objects, wires, shown_lights, camera, canvas, encoding, self.point_size)
                canvas.resolve()
                depth = canvas.depth(view, unit * getattr(camera, "depth_scale", 1.0), getattr(camera, "planes", None))
            else:
                canvas.resolve()
            return depth if depth_only else (canvas.colour(4 if RenderFlags.RGBA in wanted else 3), depth)

    def normals(self, scene: Any, flags: int = RenderFlags.NONE) -> Any:
        """Returns the unit shading normals (H, W, 3) float32 in world space at the pixels' middles, 0 where nothing is drawn.

        Normal maps count. Points and lines are drawn, too. To see normals as colours, use `(normals + 1) / 2`.
        scene: a pyrender.Scene.
        flags: with SKIP_CULL_FACES, back faces are drawn, too; their normals are turned to the side that is visible. Other
            flags have no effect.
        Errors: SceneError; GlshadeError after `delete`.
        """
        from glshade.assembly.part import Part
        from glshade.pyrender.scene import Look, screen
        from glshade.scene.film import Film
        from glshade.scene.scene import Scene

        painter, size, camera = self._begin(scene)
        result = np.zeros((size[1], size[0], 3), dtype=np.float32)
        look = Look(both=RenderFlags.SKIP_CULL_FACES in RenderFlags(int(flags)), together=True)
        converted = self._conversion.convert(scene, scene.mesh_nodes, look, lambda: screen(camera, size))
        for note in converted.notes:
            self._warn(note)
        if converted.objects:
            film = Film(size=size).model_copy(update={"point_size": self.point_size})
            drawn = Scene.model_construct(objects=tuple(converted.objects), lights=(), camera=camera, film=film)
            (pixels,) = painter.renderer.draw_part(drawn, Part("normal"))
            length = np.linalg.norm(pixels[..., :3], axis=2, keepdims=True)
            np.divide(pixels[..., :3], length, out=result, where=length > 0)
        # A picture that is upside down is drawn the right way up and turned here.
        return result[::-1] if getattr(camera, "flipped", False) else result

    def faces(self, scene: Any, flags: int = RenderFlags.NONE) -> Any:
        """Returns (triangle, surface, surfaces) of what is visible at the pixels' middles.

        triangle: (H, W) int32, the number of the triangle in its primitive, from 0; -1 where no triangle is drawn.
        surface: (H, W) int32, the number of the triangle's surface in `surfaces`; -1 where no triangle is drawn.
        surfaces: a list of (node, number of the primitive in the node's mesh, number of the instance).

        Points and lines are left out, and blended surfaces count as opaque.
        scene: a pyrender.Scene.
        flags: with SKIP_CULL_FACES, back faces are drawn, too. Other flags have no effect.
        Errors: SceneError, also for more than 16,777,215 triangles; GlshadeError after `delete`.
        """
        from glshade.pyrender.faces import decoded, numbered
        from glshade.pyrender.scene import AS_THEY_ARE

        painter, size, camera = self._begin(scene)
        objects, surfaces, starts = numbered(scene, RenderFlags.SKIP_CULL_FACES in RenderFlags(int(flags)))
        with painter.renderer.context.gl as gl:
            gl.gc()
            canvas = painter.canvas(size, 1, True)
            canvas.begin((0.0, 0.0, 0.0, 0.0))
            if objects:
                painter.paint(objects, set(), AS_THEY_ARE, camera, canvas, "linear")
            canvas.resolve()
            codes = canvas.colour(3)
        return (*decoded(codes, starts), surfaces)

    def _begin(self, scene: Any) -> tuple[Painter, tuple[int, int], Any]:
        """Returns (painter, size of the pictures [pixels], glshade's camera). Errors: SceneError, GlshadeError."""
        from glshade.pyrender.scene import main_camera

        if self._painter is None:
            raise GlshadeError("this OffscreenRenderer was deleted; create another")
        size = (self.viewport_width, self.viewport_height)
        if min(size) < 1:
            raise SceneError(f"a viewport of {size[0]} x {size[1]} pixels has no picture: both must be 1 or more")
        camera = main_camera(scene, size)
        if camera is None:
            raise SceneError("the scene has no camera")
        if note := getattr(camera, "note", ""):
            self._warn(note)
        return self._painter, size, camera

    @property
    def _renderer(self) -> Any:
        """pyrender's private renderer, whose shaders programs replace; here it is an error, which names the calls to use."""
        raise GlshadeError(NO_SHADERS)

    @_renderer.setter
    def _renderer(self, value: Any) -> None:
        raise GlshadeError(NO_SHADERS)

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


def _counted(name: str, value: int) -> int:
    """Returns a number that must be 1 or more. Errors: GlshadeError, which begins with the name."""
    if int(value) != value or value < 1:
        raise GlshadeError(f"{name} = {value}: it must be a whole number, 1 or more")
    return int(value)


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
