"""Raster: measures a driver's rasteriser: the grid to which it snaps corners, the corners from which it interpolates attributes
(as given or snapped), whether it clips triangles at the sides of the view, and the positions of samples in a pixel.
"""

from __future__ import annotations

import ctypes
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.driver.figures import rounded
from glshade.driver.programs import load_program
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.gl.screen import Screen
from glshade.reference.raster import SUBPIXELS

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]

# The values of OpenGL's enumerants in Khronos' registry (gl.xml).
GL_SUBPIXEL_BITS, GL_SAMPLE_POSITION = 0x0D50, 0x8E50
# `_subpixel_bits` cannot see a finer grid than one of this many bits.
FINEST = 10


def measure_raster(context: Context) -> dict[str, Any]:
    """Measures properties of the rasteriser. Returns a dictionary ready for JSON:

    "subpixel_bits": the number of binary digits below one pixel of a corner's coordinates: "told" is the driver's own answer,
        "measured" is the result of drawing, at most FINEST.
    "interpolation_shift_in_steps": see `_interpolation_shift`.
    "clips_at_sides": whether triangles are clipped at the sides of the view; None if it cannot be seen, because the driver does
        not snap corners to 1/256 pixel or a coarser grid.
    "sample_positions": see `_sample_positions`.
    Errors: ShaderError, ContextError.
    """
    program = load_program(context, "driver/geometry.vert", "driver/geometry.frag")
    bits = _subpixel_bits(context, program)
    return {
        "subpixel_bits": {"told": _reported_subpixel_bits(context), "measured": bits},
        "interpolation_shift_in_steps": _interpolation_shift(context, program),
        "clips_at_sides": _clips_at_sides(context, program) if 2**bits <= SUBPIXELS else None,
        "sample_positions": _sample_positions(context),
    }


def _draw(context: Context, program: Program, size: tuple[int, int], corners: Array) -> Float32:
    """Draws triangles on a screen and returns its pixels (H, W, 4); shaders/driver/geometry.frag explains their values.

    size: width, height of the screen [pixels].
    corners: (3 * T, 2), x and y of the corners of T triangles, from the lower left [pixels].
    """
    screen = Screen(context, size)
    program.write("u_size", np.array(size, dtype=np.float32))
    screen.draw_triangles(program, "a_corner", corners.astype(np.float32))
    return screen.readback()


def _reported_subpixel_bits(context: Context) -> int | None:
    """Returns GL_SUBPIXEL_BITS; None if the backend cannot look up functions of OpenGL."""
    get = context.procedure("glGetIntegerv", None, ctypes.c_uint, ctypes.POINTER(ctypes.c_int))
    if get is None:
        return None
    value = ctypes.c_int()
    get(GL_SUBPIXEL_BITS, ctypes.byref(value))
    return value.value


def _subpixel_bits(context: Context, program: Program) -> int:
    """Returns the number of binary digits below one pixel to which the driver snaps corners.

    To find it, this function counts how many grid points a corner takes while it slides over 1/16 pixel. Each of 64 columns
    holds a quadrilateral whose left edge leans from x = 0.25 at the bottom to x = 0.75 + d at the top, where d grows from
    column to column. The edge crosses the middle of its column at a height that depends on d: if d grows by 1/256 pixel, the
    crossing moves by more than 6 of the 2048 rows. So two columns have equally many covered pixels only if the driver snaps
    their upper left corners to the same grid point.
    """
    columns, rows = 2**FINEST // 16, 2048
    column = np.arange(columns, dtype=np.float64)
    d = column / 2.0**FINEST

    def corner(x: Array, y: float) -> Array:
        return np.stack([x, np.full(columns, y)], axis=1)

    lower_left, upper_left = corner(column + 0.25, 0), corner(column + 0.75 + d, rows)
    lower_right, upper_right = corner(column + 1.0, 0), corner(column + 1.0, rows)
    lower = np.stack([lower_left, lower_right, upper_right], axis=1)
    upper = np.stack([lower_left, upper_right, upper_left], axis=1)
    pixels = _draw(context, program, (columns, rows), np.concatenate([lower, upper]).reshape(-1, 2))
    heights = (pixels[..., 3] > 0).sum(axis=0)
    steps = len(np.unique(heights)) - 1
    return round(math.log2(steps * 16)) if steps > 0 else 0


def _interpolation_shift(context: Context, program: Program) -> float:
    """Returns how far attributes move if every corner lies 0.4 of a sub-pixel step beside the grid [steps].

    The result is 0 if attributes are interpolated from the corners as given, and 0.4 if from the corners after snapping.
    """
    step = 0.4 / SUBPIXELS
    corners = np.array([[2 + step, 2], [62 + step, 2], [2 + step, 62]])
    pixels = _draw(context, program, (64, 64), corners)
    shift = pixels[pixels[..., 3] > 0][:, 0].astype(np.float64)
    return rounded(np.median(shift) * SUBPIXELS)


def _clips_at_sides(context: Context, program: Program) -> bool:
    """Returns whether the driver clips triangles that reach beyond the side of the view.

    A clipped triangle gets new corners at the side, which are snapped to the grid. Each of four triangles has an edge that
    rises from a corner in the view by a few sub-pixel steps, to a corner twice as far away as the side. Snapping at the side
    turns the edge, so that it passes the centres of a row of pixels elsewhere: by at least 6 of the 256 pixels.
    """
    width, start, reach = 256, 8.0, 504.0
    for steps in (5, 7, 9, 11):
        # The edge passes the row's centres, at 4.5, after a rise of 2 steps.
        low = 4.5 - 2 / SUBPIXELS
        corners = np.array([[start, low], [reach, low + steps / SUBPIXELS], [start, 12.0]])
        covered = (_draw(context, program, (width, 8), corners)[4, :, 3] > 0).sum()
        if abs(covered - (reach - start) * 2 / steps) > 2:
            return True
    return False


def _sample_positions(context: Context) -> list[list[float]]:
    """Returns the positions of the samples within a pixel, x and y from 0 to 1, for the largest number of samples.

    The list is empty if the driver has no multisampling or if the backend cannot look up functions of OpenGL.
    """
    get = context.procedure("glGetMultisamplefv", None, ctypes.c_uint, ctypes.c_uint, ctypes.POINTER(ctypes.c_float))
    samples = context.gl.max_samples
    if get is None or samples < 2:
        return []
    # OpenGL reports the positions for the framebuffer that is bound.
    context.gl.framebuffer([context.gl.renderbuffer((4, 4), 4, samples=samples)]).use()
    found = []
    for index in range(samples):
        position = (ctypes.c_float * 2)()
        get(GL_SAMPLE_POSITION, index, position)
        found.append([rounded(position[0]), rounded(position[1])])
    return found
