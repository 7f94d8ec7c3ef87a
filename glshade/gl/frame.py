"""Frame: the colour and depth buffers that the GPU draws into, with the resolving of samples and the readback of pixels."""

from __future__ import annotations

import ctypes
from typing import Any, Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.gl.context import Context

GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F = 0x8D41, 0x8CAC
# x, y, width, height [pixels], from the top left.
Box = tuple[int, int, int, int]
Storage = Literal["rgba8", "rgb10_a2", "r11f_g11f_b10f", "rgba16f", "rgba32f"]
# Storage -> (internal format by Khronos' registry (gl.xml), number of channels).
FORMATS: dict[Storage, tuple[int, int]] = {
    "rgba8": (0x8058, 4),
    "rgb10_a2": (0x8059, 4),
    "r11f_g11f_b10f": (0x8C3A, 3),
    "rgba16f": (0x881A, 4),
    "rgba32f": (0x8814, 4),
}


class Frame:
    """A colour and a depth buffer of one size.

    With several samples per pixel, their colours are averaged when they are read back or passed on.

    size: width and height [pixels].
    storage: the format of the colours: rgba8 for encoded pictures, rgba32f for linear light, other formats to measure the
        precision that linear light loses in them.
    samples: the number of samples per pixel.
    texture: the colours, one per pixel; valid after resolve().
    target: the framebuffer to draw into.
    part: the box that begin() restricted the drawing to; None for the whole frame.
    """

    def __init__(self, context: Context, size: tuple[int, int], storage: Storage, samples: int = 1) -> None:
        """Allocates the buffers on a context, which must be current."""
        gl = context.gl
        self.size, self.storage, self.samples = size, storage, samples
        format_, channels = FORMATS[storage]
        dtype = "f1" if storage == "rgba8" else "f4"
        self.texture = gl.texture(size, channels, dtype=dtype, internal_format=format_)
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        # A renderbuffer with 0 samples has no multisampling.
        buffer_samples = 0 if samples == 1 else samples
        self._depth = gl.depth_renderbuffer(size, samples=buffer_samples)
        # Reversed depth needs 32-bit floats to gain precision, and moderngl allocates 24-bit integers.
        store(context, self._depth.glo, GL_DEPTH_COMPONENT32F, size, buffer_samples)
        self._resolved = gl.framebuffer([self.texture], self._depth if samples == 1 else None)
        self._colour = None if samples == 1 else gl.renderbuffer(size, channels, samples=buffer_samples, dtype=dtype)
        if self._colour is not None:
            store(context, self._colour.glo, format_, size, buffer_samples)
        self.target = self._resolved if self._colour is None else gl.framebuffer([self._colour], self._depth)
        self.part: Box | None = None
        self._gl = gl

    def begin(self, background: tuple[float, float, float, float], part: Box | None = None) -> None:
        """Binds the frame and clears it to the background and to the farthest depth (0, since depth is reversed).

        background: red, green, blue and alpha, encoded and premultiplied as the storage needs it.
        part: optional; the only box to clear and draw. Its pixels have the same bits as in a whole drawing, because the
            scissor box has no side effects (OpenGL 4.6 core, A.3, rule 2).
        """
        self.part = part
        self.target.scissor = part  # type: ignore[assignment]
        self.target.use()
        self.target.clear(*background, depth=0.0)

    def resolve(self) -> moderngl.Texture:
        """Returns the texture of colours with one sample per pixel: several samples are averaged into it."""
        if self.target is not self._resolved:
            self._gl.copy_framebuffer(self._resolved, self.target)
        return self.texture

    def readback(self, out: NDArray[Any], corner: tuple[int, int] = (0, 0)) -> None:
        """Copies pixels of the frame into an array.

        out: the array (H, W, 4) to fill, uint8 or float32 and contiguous, row 0 at the top.
        corner: the pixel (x, y) of the frame that becomes its upper left one.
        """
        self.resolve()
        self.read(out, corner)

    def read(self, out: NDArray[Any], corner: tuple[int, int] = (0, 0)) -> None:
        """Copies pixels of the frame into an array, as `readback` does; valid after resolve()."""
        height, width, _ = out.shape
        dtype = "f1" if out.dtype == np.uint8 else "f4"
        self._resolved.read_into(out, (*corner, width, height), components=4, alignment=1, dtype=dtype)


def store(context: Context, renderbuffer: int, format_: int, size: tuple[int, int], samples: int) -> None:
    """Allocates a renderbuffer in an internal format that moderngl does not offer.

    context: the current context.
    renderbuffer: the GL name of the renderbuffer.
    format_: the internal format.
    size: width and height [pixels].
    samples: the number of samples per pixel, 0 for a buffer without multisampling.
    """
    bind = context.procedure("glBindRenderbuffer", None, ctypes.c_uint, ctypes.c_uint)
    # The arguments are target, samples, format, width and height.
    store = context.procedure(
        "glRenderbufferStorageMultisample", None, ctypes.c_uint, ctypes.c_int, ctypes.c_uint, ctypes.c_int, ctypes.c_int
    )
    if bind is not None and store is not None:
        bind(GL_RENDERBUFFER, renderbuffer)
        store(GL_RENDERBUFFER, samples, format_, *size)
