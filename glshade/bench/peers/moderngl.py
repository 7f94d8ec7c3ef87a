"""moderngl: a peer that uses nothing but moderngl, written as an expert would write it for just this picture."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.bench.peers._glsl import FRAGMENT
from glshade.bench.stage import COLOURS, POSITIONS, TO_LIGHT, WorkFiles, look_at, perspective

VERTEX = """\
#version 330
in vec3 position;
out vec3 p, n;
uniform mat4 clip_from_world;

void main() {
    p = n = position;
    gl_Position = clip_from_world * vec4(position, 1.0);
}
"""
# The versioned name of the library; machines without development packages lack the unversioned one.
LIBEGL = "libEGL.so.1"


class Peer:
    """Draws indexed triangles with back faces culled, changes only the camera, and reads pixels into an existing array."""

    def __init__(self, stage: WorkFiles) -> None:
        gl = moderngl.create_context(standalone=True, backend="egl", libegl=LIBEGL, libgl=LIBEGL)  # type: ignore[arg-type]
        self.driver = f"{gl.info['GL_RENDERER']}; {gl.info['GL_VERSION']}"
        size = (stage.side, stage.side)
        self._target = gl.simple_framebuffer(size)
        self._target.use()
        gl.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        # The picture is drawn upside down, so that row 0 is the top. This makes counter-clockwise triangles clockwise.
        gl.front_face = "cw"
        self._flipped = np.diag([1.0, -1.0, 1.0, 1.0]) @ perspective()
        positions, triangles = stage.arrays()
        program = gl.program(VERTEX, FRAGMENT[stage.lights])
        # A unit sphere around the origin needs no array of normals: each normal equals the vertex position.
        self._mesh = gl.vertex_array(program, [(gl.buffer(positions), "3f", "position")], gl.buffer(triangles))
        uniforms: dict[str, Any] = {"to_light": TO_LIGHT, "positions": POSITIONS, "colours": COLOURS}
        for name, value in uniforms.items():
            if name in program:
                program[name].write(np.asarray(value, dtype="f4"))  # type: ignore[union-attr]
        self._program = program
        self._rgba = np.empty((*size, 4), dtype=np.uint8)
        self._rgb = np.empty((*size, 3), dtype=np.uint8)

    def _draw(self, eye: tuple[float, float, float]) -> None:
        clip = self._flipped @ look_at(eye)
        self._program["clip_from_world"].write(np.ascontiguousarray(clip.T, dtype="f4"))  # type: ignore[union-attr]
        self._program["eye"] = eye
        self._target.clear(0.0, 0.0, 0.0, 1.0)
        self._mesh.render()

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        self._draw(eye)
        self._target.read_into(self._rgba, components=4)
        return self._rgba

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        from PIL import Image

        self._draw(eye)
        self._target.read_into(self._rgb, components=3, alignment=1)
        Image.fromarray(self._rgb).save(path)
