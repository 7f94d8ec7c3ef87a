"""Stage: what the works share. Each program draws with the camera, the light and the material of `glshade.bench.stage`."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.stage import AMBIENT, EXPONENT, EYE, FAR, FOV, KD, KS, NEAR, TO_LIGHT, eye, look_at, perspective, sphere

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer
    from glshade.scene.scene import Scene

Array = NDArray[Any]
# Width and height of the pictures, unless a work says otherwise [pixels].
SIZE = (512, 512)
MATERIAL = {"brdf": "phong", "kd": list(KD), "ks": KS, "exponent": EXPONENT, "ka": [AMBIENT * x for x in KD]}
LIGHTS = ({"type": "ambient"}, {"type": "directional", "direction": [-x for x in TO_LIGHT]})
# The versioned name of the library; machines without development packages lack the unversioned one.
LIBEGL = "libEGL.so.1"

# Shaders that are written for just these pictures. `colour` of a vertex or a texture takes the place of kd.
VERTEX = """\
#version 330
in vec3 position, normal;
in vec2 uv;
in vec4 place;  // an instance's position and scale
out vec3 p, n;
out vec2 t;
uniform mat4 clip_from_world;

void main() {
    p = position PLACED;
    n = normal;
    t = uv;
    gl_Position = clip_from_world * vec4(p, 1.0);
}
"""
FRAGMENT = """\
#version 330
in vec3 p, n;
in vec2 t;
out vec4 colour;
uniform vec3 eye, to_light;
uniform sampler2D picture;

void main() {
    vec3 kd = KD;
    vec3 N = normalize(n), v = normalize(eye - p);
    float d = max(dot(N, to_light), 0.0);
    float s = max(dot(reflect(-to_light, N), v), 0.0);
    colour = vec4(kd * (AMBIENT + d) + (d > 0.0 ? 0.5 * pow(s, 32.0) : 0.0), 1.0);
}
"""
KD_TEXT = f"vec3({', '.join(map(str, KD))})"


def camera(position: Any = EYE) -> dict[str, Any]:
    """Returns a camera at a position that looks at the origin, as a table of a scene file."""
    return {"eye": list(position), "target": (0, 0, 0), "fov": FOV, "near": NEAR, "far": FAR}


def scene(objects: Any, size: tuple[int, int] = SIZE, samples: int = 1, position: Any = EYE) -> Scene:
    """Returns a scene of glshade under the light of all works, with linear 8-bit values."""
    from glshade.scene.scene import Scene

    film = {"size": size, "samples": samples, "encoding": "linear"}
    return Scene.model_validate({"objects": objects, "lights": LIGHTS, "camera": camera(position), "film": film})


def clip_from_world(position: Any, size: tuple[int, int] = SIZE) -> NDArray[np.float64]:
    """Returns the matrix (4, 4) from world space to the clip space of a camera at a position that looks at the origin."""
    aspect = np.diag([size[1] / size[0], 1.0, 1.0, 1.0])
    clip: NDArray[np.float64] = aspect @ perspective() @ look_at(position)
    return clip


def grid(count: int) -> NDArray[np.float64]:
    """Returns the places of spheres in a square: x, y, z, radius (count, 4)."""
    across = int(np.ceil(np.sqrt(count)))
    cells = (np.stack(np.unravel_index(np.arange(count), (across, across)), axis=1) + 0.5) / across * 2 - 1
    return np.column_stack([cells, np.zeros(count), np.full(count, 0.8 / across)])


def terrain(side: int) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Returns (positions (side^2, 3), triangles (2 (side - 1)^2, 3)) of a wavy square in the plane of the picture."""
    steps = np.linspace(-1, 1, side)
    x, y = np.meshgrid(steps, steps)
    positions = np.stack([x, y, 0.1 * np.sin(7 * x) * np.cos(5 * y)], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1, 1)
    halves = np.array([[0, 1, side + 1], [0, side + 1, side]])
    triangles = np.concatenate([corner + half for half in halves]).astype(np.uint32)
    return positions, triangles


class Own:
    """A program of glshade that keeps a Renderer, which is opened when it is first needed."""

    driver: str | None = None

    def __init__(self, size: int, folder: Path) -> None:
        import glshade.gl.renderer
        import glshade.mesh.mesh
        import glshade.scene.scene  # noqa: F401 a work of the kind "first" does not count the imports

        self.size, self.folder = size, folder

    @cached_property
    def renderer(self) -> Renderer:
        from glshade.gl.renderer import Renderer

        renderer = Renderer()
        self.driver = f"{renderer.context.renderer}; {renderer.context.version}"
        return renderer

    def prepare(self, number: int) -> Any:
        """Returns the position of the camera."""
        return eye(number + 1)


class Hand:
    """A program that is written by hand with moderngl: a target of one size, and one shader program.

    samples: number of samples a pixel
    pixels: width and height of the target [pixels]
    kd: GLSL of the diffuse reflectance
    ambient: intensity of the ambient light
    placed: GLSL that moves and scales a vertex of an instance
    """

    driver: str | None = None
    samples = 1
    pixels = SIZE
    kd = KD_TEXT
    ambient = AMBIENT
    placed = ""

    def __init__(self, size: int, folder: Path) -> None:
        import moderngl

        self.size, self.folder = size, folder
        self.gl = gl = moderngl.create_context(standalone=True, backend="egl", libegl=LIBEGL, libgl=LIBEGL)  # type: ignore[arg-type]
        self.driver = f"{gl.info['GL_RENDERER']}; {gl.info['GL_VERSION']}"
        self.target = self.resolved = gl.simple_framebuffer(self.pixels)
        if self.samples > 1:
            buffers = gl.renderbuffer(self.pixels, 4, self.samples), gl.depth_renderbuffer(self.pixels, self.samples)
            self.target = gl.framebuffer([buffers[0]], buffers[1])
        self.target.use()
        gl.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        # The picture is drawn upside down, so that row 0 is the top. This makes counter-clockwise triangles clockwise.
        gl.front_face = "cw"
        self.program: Any = gl.program(
            VERTEX.replace("PLACED", self.placed), FRAGMENT.replace("KD", self.kd).replace("AMBIENT", str(self.ambient))
        )
        self.program["to_light"] = TO_LIGHT
        self.rgba = np.empty((self.pixels[1], self.pixels[0], 4), dtype=np.uint8)

    def look(self, position: Any, size: tuple[int, int] | None = None) -> None:
        """Sets the camera, for a picture of a size [pixels]."""
        clip = np.diag([1.0, -1.0, 1.0, 1.0]) @ clip_from_world(position, size or self.pixels)
        self.program["clip_from_world"].write(np.ascontiguousarray(clip.T, dtype="f4"))
        self.program["eye"] = tuple(position)

    def read(self) -> Array:
        """Returns the pixels (H, W, 4) of the target."""
        if self.samples > 1:
            self.gl.copy_framebuffer(self.resolved, self.target)
        self.resolved.read_into(self.rgba, components=4)
        return self.rgba

    def prepare(self, number: int) -> Any:
        """Returns the position of the camera."""
        return eye(number + 1)


class Pyrender:
    """A program of pyrender: a scene with a camera and the sun, drawn by `renderer`."""

    driver: str | None = None
    pixels = SIZE

    def __init__(self, size: int, folder: Path) -> None:
        os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
        import pyrender

        self.size, self.folder, self.pyrender = size, folder, pyrender
        self.scene = pyrender.Scene(bg_color=(0.0, 0.0, 0.0, 0.0), ambient_light=(AMBIENT,) * 3)
        lens = pyrender.PerspectiveCamera(np.radians(FOV), znear=NEAR, zfar=FAR)
        self.camera = self.scene.add(lens, pose=np.linalg.inv(look_at(EYE)))
        # An illuminance of E lux corresponds to an intensity of E / pi in glshade.
        sun = pyrender.DirectionalLight(color=np.ones(3), intensity=np.pi)
        self.scene.add(sun, pose=np.linalg.inv(look_at(TO_LIGHT)))
        self.renderer_class = self.renderers()

    def renderers(self) -> Any:
        """Returns the class of the renderer."""
        return self.pyrender.OffscreenRenderer

    @cached_property
    def renderer(self) -> Any:
        return self.renderer_class(*self.pixels)

    def material(self, **options: Any) -> Any:
        """Returns a dielectric as glossy as a Phong exponent n of 32: alpha = sqrt(2 / (n + 2)), roughness = sqrt(alpha)."""
        return self.pyrender.MetallicRoughnessMaterial(
            **{"baseColorFactor": (*KD, 1.0), "metallicFactor": 0.0, "roughnessFactor": 0.5, **options}
        )

    def look(self, position: Any) -> None:
        """Moves the camera."""
        self.scene.set_pose(self.camera, np.linalg.inv(look_at(position)))

    def render(self) -> Array:
        """Returns the picture (H, W, 3)."""
        colour: Array = self.renderer.render(self.scene)[0]
        return colour

    def prepare(self, number: int) -> Any:
        """Returns the position of the camera."""
        return eye(number + 1)


class Door(Pyrender):
    """The same scene, drawn by glshade.pyrender."""

    def renderers(self) -> Any:
        from glshade.pyrender import OffscreenRenderer

        return OffscreenRenderer


__all__ = [
    "EYE",
    "KD",
    "LIGHTS",
    "MATERIAL",
    "SIZE",
    "Array",
    "Door",
    "Hand",
    "Own",
    "Pyrender",
    "camera",
    "clip_from_world",
    "eye",
    "grid",
    "scene",
    "sphere",
    "terrain",
]
