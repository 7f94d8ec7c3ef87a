"""Panda3D: a peer without a window, which uses the GLSL of the peer moderngl.

Panda3D's own shading would either evaluate light only at each vertex, or be slower.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from panda3d import core

from glshade.bench.peers._glsl import FRAGMENT
from glshade.bench.stage import COLOURS, EYE, FAR, FOV, NEAR, POSITIONS, TO_LIGHT, WorkFiles

SETTINGS = """\
load-display p3headlessgl
window-type offscreen
audio-library-name null
sync-video 0
notify-level-display error
"""
VERTEX = """\
#version 330
in vec4 p3d_Vertex;
in vec3 p3d_Normal;
out vec3 p, n;
uniform mat4 p3d_ModelViewProjectionMatrix;

void main() {
    p = p3d_Vertex.xyz;
    n = p3d_Normal;
    gl_Position = p3d_ModelViewProjectionMatrix * p3d_Vertex;
}
"""


class Peer:
    """An offscreen buffer whose texture is copied to memory after each frame."""

    def __init__(self, stage: WorkFiles) -> None:
        core.load_prc_file_data("", SETTINGS)
        self._engine = core.GraphicsEngine.get_global_ptr()
        pipe = core.GraphicsPipeSelection.get_global_ptr().make_default_pipe()
        format = core.FrameBufferProperties()
        format.set_rgba_bits(8, 8, 8, 8)
        format.set_depth_bits(24)
        size = core.WindowProperties.size(stage.side, stage.side)
        target = self._engine.make_output(pipe, "picture", 0, format, size, core.GraphicsPipe.BF_refuse_window)
        if target is None:
            raise RuntimeError("Panda3D gives no offscreen buffer")
        self._texture, self._side = core.Texture(), stage.side
        target.add_render_texture(self._texture, core.GraphicsOutput.RTM_copy_ram)
        target.set_clear_color((0, 0, 0, 1))
        # Keep the root alive: Panda3D frees the nodes below it together with it.
        self._root = core.NodePath("root")
        self._sphere = self._root.attach_new_node(_geometry(*stage.arrays()))
        self._sphere.set_shader(core.Shader.make(core.Shader.SL_GLSL, VERTEX, FRAGMENT[stage.lights]))
        self._sphere.set_shader_input("to_light", core.Vec3(*TO_LIGHT))
        for name, rows in (("positions", POSITIONS), ("colours", COLOURS)):
            self._sphere.set_shader_input(name, core.PTA_LVecBase3f([core.LVecBase3f(*row) for row in rows.tolist()]))
        lens = core.PerspectiveLens()
        lens.set_fov(FOV, FOV)
        lens.set_near_far(NEAR, FAR)
        self._camera = self._root.attach_new_node(core.Camera("camera", lens))
        target.make_display_region().set_camera(self._camera)
        # Panda3D creates the buffer in the first frame and draws into it from the second on.
        for _ in range(2):
            self._render(EYE)
        gsg = target.get_gsg()
        self.driver = f"{gsg.get_driver_renderer()}; {gsg.get_driver_version()}"

    def _render(self, eye: tuple[float, float, float]) -> None:
        self._camera.set_pos(*eye)
        self._camera.look_at(core.Point3(0, 0, 0), core.Vec3(0, 1, 0))
        self._sphere.set_shader_input("eye", core.Vec3(*eye))
        self._engine.render_frame()

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        self._render(eye)
        pixels = np.frombuffer(self._texture.get_ram_image_as("RGB"), dtype=np.uint8)
        return pixels.reshape(self._side, self._side, 3)[::-1]

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        self._render(eye)
        picture = core.PNMImage()
        self._texture.store(picture)
        picture.remove_alpha()
        picture.write(core.Filename(path))


def _geometry(positions: NDArray[Any], triangles: NDArray[Any]) -> Any:
    vertices = core.GeomVertexData("sphere", core.GeomVertexFormat.get_v3n3(), core.Geom.UH_static)
    vertices.unclean_set_num_rows(len(positions))
    np.frombuffer(vertices.modify_array(0), dtype=np.float32)[:] = np.hstack([positions, positions]).ravel()
    faces = core.GeomTriangles(core.Geom.UH_static)
    faces.set_index_type(core.Geom.NT_uint32)
    corners = faces.modify_vertices()
    corners.unclean_set_num_rows(triangles.size)
    np.frombuffer(corners, dtype=np.uint32)[:] = triangles.ravel()
    geometry = core.Geom(vertices)
    geometry.add_primitive(faces)
    node = core.GeomNode("sphere")
    node.add_geom(geometry)
    return node
