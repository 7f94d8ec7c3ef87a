"""Screen: targets for programs that compute numbers, in the fragment stage (Screen) or in the vertex stage (Capture)."""

from __future__ import annotations

from typing import Any, Literal
from weakref import WeakKeyDictionary

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.errors import ContextError
from glshade.gl.context import Context
from glshade.gl.frame import FORMATS, Storage
from glshade.gl.program import Program

Float32 = NDArray[np.float32]
Encoded = Literal["srgb8_alpha8"]

# Khronos' registry values (gl.xml).
GL_FRAMEBUFFER_SRGB, GL_SRGB8_ALPHA8 = 0x8DB9, 0x8C43


class Screen:
    """A colour target without a depth buffer. All of its pixels are (0, 0, 0, 0) at first. Row 0 is at the bottom.

    size: width and height [pixels].
    """

    def __init__(self, context: Context, size: tuple[int, int], storage: Storage | Encoded = "rgba32f") -> None:
        """Allocates the target.

        context: the context, which must be current.
        size: width and height [pixels].
        storage: the format of the pixels. "srgb8_alpha8" takes linear light and stores it sRGB-encoded.
        Errors: ContextError if the driver cannot draw into the format.
        """
        self._gl, self.size = context.gl, size
        format_, channels = (GL_SRGB8_ALPHA8, 4) if storage == "srgb8_alpha8" else FORMATS[storage]
        try:
            self._target = self._gl.framebuffer([self._gl.texture(size, channels, dtype="f4", internal_format=format_)])
        except moderngl.Error as error:
            raise ContextError(f"the driver cannot draw into {storage}: {error}") from None
        # With this switch the driver encodes colours that are drawn into sRGB formats. Other formats ignore it.
        self._gl.enable_direct(GL_FRAMEBUFFER_SRGB)
        self._target.clear(0.0, 0.0, 0.0, 0.0)
        self._samples: moderngl.Texture | None = None
        self._arrays: WeakKeyDictionary[Program, moderngl.VertexArray] = WeakKeyDictionary()

    def bind(self) -> None:
        """Makes the screen the target of the next draw, without depth test, culling and blending."""
        self._target.use()
        self._gl.enable_only(moderngl.NOTHING)

    def array(self, program: Program) -> moderngl.VertexArray:
        """Returns the program's vertex array without attributes, from a cache."""
        if program not in self._arrays:
            self._arrays[program] = self._gl.vertex_array(program.gl, [])
        return self._arrays[program]

    def upload(self, texels: Float32) -> None:
        """Binds texels (H, W, 4) as a texture to unit 0, which every sampler reads unless it is set to another unit."""
        height, width, channels = texels.shape
        # The screen keeps a reference, because a texture that nothing refers to may be freed before the draw.
        self._samples = self._gl.texture((width, height), channels, np.ascontiguousarray(texels), dtype="f4")
        self._samples.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._samples.use(0)

    def draw(self, program: Program) -> None:
        """Draws three vertices without attributes: shaders/pass/picture.vert makes them a triangle that covers the screen."""
        self.bind()
        self.array(program).render(moderngl.TRIANGLES, vertices=3)

    def draw_triangles(self, program: Program, attribute: str, corners: Float32) -> None:
        """Draws triangles.

        program: the program, which has one vertex attribute.
        attribute: the name of the attribute.
        corners: its values (3 * triangles, components).
        """
        self.bind()
        buffer = self._gl.buffer(np.ascontiguousarray(corners))
        array = self._gl.vertex_array(program.gl, [(buffer, f"{corners.shape[1]}f", attribute)])
        array.render(moderngl.TRIANGLES)

    def readback(self) -> Float32:
        """Returns the pixels as they are stored, (H, W, 4). Colours that the format lacks read as 0, and a missing alpha reads
        as 1.
        """
        width, height = self.size
        return _floats(self._target.read(components=4, dtype="f4")).reshape(height, width, 4)


class Capture:
    """A buffer that captures an output of the vertex stage by transform feedback. The program must be linked with that output
    as its varying."""

    def __init__(self, context: Context, vertices: int, components: int) -> None:
        """Allocates the buffer.

        context: the context, which must be current.
        vertices: the number of vertices of a draw.
        components: the number of components of the captured output.
        """
        self._shape = (vertices, components)
        self._buffer = context.gl.buffer(reserve=4 * vertices * components)
        # Without a bound framebuffer, llvmpipe captures zeros and reports no error.
        self._screen = Screen(context, (1, 1))

    def draw(self, program: Program) -> None:
        """Runs the vertex stage once per vertex, without attributes: gl_VertexID counts from 0."""
        self._screen.bind()
        self._screen.array(program).transform(self._buffer, moderngl.POINTS, vertices=self._shape[0])

    def readback(self) -> Float32:
        """Returns the values (vertices, components) of the last draw."""
        return _floats(self._buffer.read()).reshape(self._shape)


def _floats(data: Any) -> Float32:
    return np.frombuffer(data, dtype=np.float32)
