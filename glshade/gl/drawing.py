"""Drawing: executes draw calls, and sets only the state that differs from call to call."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.assembly.strokes import Squares
from glshade.gl.context import Context
from glshade.gl.points import draw_points
from glshade.gl.preparation import DrawCall


class Drawing:
    """Draws into the bound framebuffer, whose context must be current.

    context: the context.
    clip: the matrix (4, 4) from positions relative to the eye to clip space.
    viewer: the unit direction (3,) to the viewer of an orthographic view.
    """

    def __init__(self, context: Context, clip: NDArray[np.float32], viewer: NDArray[np.float32]) -> None:
        self.context, self.clip, self.viewer = context, clip, viewer
        # A program keeps its uniforms from call to call, so that they are set only when they change.
        self._held: dict[int, dict[str, NDArray[np.float32]]] = {}
        self._lit: dict[int, int] = {}
        self._state: tuple[bool, ...] = ()

    def draw(self, calls: Iterable[DrawCall]) -> None:
        """Executes draw calls in their order."""
        gl = self.context.gl
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = ">"
        for group in _groups(calls):
            if len(group) > 1 and group[0].plan.alpha == "blend":
                self._blend(group)
                continue
            for call in group:
                self._set(call)
                self._render(call)
        gl.fbo.depth_mask = True

    def _blend(self, group: list[DrawCall]) -> None:
        """Draws a blended surface triangle by triangle, from back to front, each with all of its calls.

        If each call drew all triangles, the light of a later call would reach those at the back unattenuated.
        """
        for first in range(0, 3 * len(group[0].instance.mesh.triangles), 3):
            for call in group:
                self._set(call)
                call.vertices.render(first=first, vertices=3)

    def _render(self, call: DrawCall) -> None:
        mesh = call.instance.mesh
        if call.vertices.mode == moderngl.POINTS and isinstance(mesh, Squares) and mesh.points:
            draw_points(self.context, call.program, call.vertices, mesh.points.screen.point_size, self.clip)
        else:
            call.vertices.render()

    def _set(self, call: DrawCall) -> None:
        """Sets the uniforms, textures and state that a call needs."""
        program = call.program
        values = self._held.get(id(program))
        if values is None:
            values = self._held[id(program)] = {}
            program.write("u_clip_from_world", self.clip)
            program.write("u_viewer", self.viewer)
        if self._lit.get(id(program)) != id(call.lights):
            self._lit[id(program)] = id(call.lights)
            for name, value in call.lights.items():
                program.write(name, value)
        for name, value in call.values.items():
            if values.get(name) is not value:
                values[name] = value
                program.write(name, value)
        for unit, (name, texture) in enumerate(call.samplers):
            texture.use(unit)
            program.set_integer(name, unit)
        for binding, (key, buffer, count) in enumerate(call.pages):
            buffer.bind_to_uniform_block(binding)
            program.members[f"{key}_page"].binding = binding
            program.set_integer(f"u_{key}_count", count)
        wanted = (call.plan.alpha == "blend", call.added, not call.instance.back_faces, call.mirrored)
        if wanted != self._state:
            self._state = wanted
            self._set_state(*wanted)

    def _set_state(self, blended: bool, added: bool, culled: bool, mirrored: bool) -> None:
        """Sets face culling, blending and the depth test for a draw call.

        blended: whether the surface is blended over the pixels behind it.
        added: whether the call draws a further page of lights.
        culled: whether back faces are culled.
        mirrored: whether the object's transform mirrors it, which reverses the winding of its triangles.
        """
        gl = self.context.gl
        (gl.enable if culled else gl.disable)(moderngl.CULL_FACE)
        # The picture is drawn upside down so that row 0 is the top, which turns counter-clockwise into clockwise.
        gl.front_face = "ccw" if mirrored else "cw"
        (gl.enable if blended or added else gl.disable)(moderngl.BLEND)
        if blended or added:
            one, rest = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
            # A further page adds its light and leaves alpha as it is.
            gl.blend_func = (one, one, moderngl.ZERO, one) if added else (one, rest, one, rest)  # type: ignore[assignment]
        # Later pages of lights add to the fragments that the first page drew, so the depth test is "equal".
        gl.depth_func = "==" if added and not blended else ">"
        gl.fbo.depth_mask = not (blended or added)


def _groups(calls: Iterable[DrawCall]) -> Iterator[list[DrawCall]]:
    """Yields each call together with those that follow it and add light to the same surface."""
    group: list[DrawCall] = []
    for call in calls:
        if group and not call.added:
            yield group
            group = []
        group.append(call)
    if group:
        yield group
