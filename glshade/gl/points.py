"""Points: draws the squares of points as OpenGL's points, one vertex each, where the driver's points are such squares."""

from __future__ import annotations

import math
from typing import Any
from weakref import WeakKeyDictionary

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.assembly.strokes import CORNERS
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.glsl.shaders import expand
from glshade.glsl.source import Source

# The side of the pictures [pixels] by which a driver is tested, and the number of their points.
TESTED, COUNT = 32, 24
# context -> (side, whether the driver draws points of this side as squares).
_tested: WeakKeyDictionary[Context, dict[float, bool]] = WeakKeyDictionary()


def draw_points(
    context: Context, program: Program, vertices: moderngl.VertexArray, side: float, clip: NDArray[np.float32]
) -> None:
    """Draws points as squares into the bound framebuffer.

    OpenGL leaves out a point whose centre is outside the picture (4.6 core profile, 13.7), although half of its square may be
    inside. So the viewport is enlarged, and the positions in clip space are made smaller by the same factor.

    program: the program, whose matrix is `u_clip_from_world`; it has the given value again afterwards.
    vertices: a vertex array in the mode POINTS.
    side: the side of the squares [pixels].
    clip: the matrix (4, 4) from positions relative to the eye to clip space, for the viewport as it is.
    """
    target = context.gl.fbo
    x, y, width, height = target.viewport
    margin = _margin(side)
    smaller = np.array([[width / (width + 2 * margin)], [height / (height + 2 * margin)], [1.0], [1.0]])
    program.write("u_clip_from_world", rounded(clip * smaller))
    target.viewport = (x - margin, y - margin, width + 2 * margin, height + 2 * margin)
    context.gl.point_size = side
    vertices.render()
    target.viewport = (x, y, width, height)
    program.write("u_clip_from_world", clip)


def _margin(side: float) -> int:
    """Returns by how much the viewport is enlarged on each side for points of a side [pixels]."""
    return math.ceil(side / 2) + 1


def are_squares(context: Context, side: float, size: tuple[int, int]) -> bool:
    """Returns whether the driver draws points of a side [pixels] as the squares that are drawn as two triangles each.

    It is tested once for each side, with one sample a pixel and with several. A driver may limit the size of points, round it,
    or draw disks. The context must be current.
    size: width, height of the picture [pixels]. One that is about as large as the driver allows leaves no room for the viewport
        to be enlarged.
    """
    if max(size) + 2 * _margin(side) > context.largest_side:
        return False
    known = _tested.setdefault(context, {})
    if side not in known:
        known[side] = all(_draws_alike(context, side, samples) for samples in (0, min(4, context.gl.max_samples)))
    return known[side]


def _draws_alike(context: Context, side: float, samples: int) -> bool:
    """Returns whether points of a side [pixels] and pairs of triangles give the same picture of COUNT squares."""
    gl = context.gl
    bound, size = gl.fbo, (TESTED, TESTED)
    # Each square has its own colour. Some centres lie outside of the picture, and some on the edges of pixels.
    shade = (np.arange(COUNT) + 1.0) / (COUNT + 1)
    centres = np.stack([np.linspace(-0.5, TESTED + 0.5, COUNT), (np.arange(COUNT) * 7.3) % TESTED, shade], axis=1)
    corners = centres[:, None] + np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * side / 2
    triangles = (4 * np.arange(COUNT, dtype=np.uint32)[:, None] + CORNERS).reshape(-1)
    clip = rounded(np.diag([2 / TESTED, 2 / TESTED, 0.0, 1.0]))
    clip[:2, 3] = -1
    program = Program(context, Source(expand("driver/points.vert", {}), expand("driver/points.frag", {})))
    target = gl.framebuffer([gl.renderbuffer(size, 4, samples=samples)])
    resolved = gl.framebuffer([gl.renderbuffer(size, 4)])
    gl.enable_only(moderngl.NOTHING)

    def vertices(positions: Any, *indices: Any) -> moderngl.VertexArray:
        content = [(gl.buffer(positions.astype(np.float32).tobytes()), "3f", "a_position")]
        return gl.vertex_array(program.gl, content, *indices)

    pictures = []
    for by_points in (True, False):
        target.use()
        target.clear()
        if by_points:
            array = vertices(centres)
            array.mode = moderngl.POINTS
            draw_points(context, program, array, side, clip)
        else:
            program.write("u_clip_from_world", clip)
            vertices(corners, gl.buffer(triangles)).render()
        gl.copy_framebuffer(resolved, target)
        pictures.append(resolved.read(components=4))
    if bound is not None:
        bound.use()
    return pictures[0] == pictures[1]
