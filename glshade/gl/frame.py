"""Frame: what the GPU draws into. Samples are resolved, and pixels are read back, here."""

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
# Internal formats (Khronos' registry, gl.xml) and their channels.
FORMATS: dict[Storage, tuple[int, int]] = {
    "rgba8": (0x8058, 4),
    "rgb10_a2": (0x8059, 4),
    "r11f_g11f_b10f": (0x8C3A, 3),
    "rgba16f": (0x881A, 4),
    "rgba32f": (0x8814, 4),
}


class Frame:
    """A colour and a depth buffer of one size.

    rgba8 for pictures to look at, drawn encoded; rgba32f for linear light, the others for what that loses in them. With several
    samples a pixel the colours are averaged, in linear light, when they are read or passed on.
    """

    def __init__(self, context: Context, size: tuple[int, int], storage: Storage, samples: int = 1) -> None:
        gl = context.gl
        self.size, self.storage, self.samples = size, storage, samples
        format_, channels = FORMATS[storage]
        dtype = "f1" if storage == "rgba8" else "f4"
        self.texture = gl.texture(size, channels, dtype=dtype, internal_format=format_)
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        several = 0 if samples == 1 else samples
        self._depth = gl.depth_renderbuffer(size, samples=several)
        # 32 bits, where reversed depth has its digits; moderngl makes 24.
        _store(context, self._depth.glo, GL_DEPTH_COMPONENT32F, size, several)
        self._resolved = gl.framebuffer([self.texture], self._depth if samples == 1 else None)
        self._colour = None if samples == 1 else gl.renderbuffer(size, channels, samples=several, dtype=dtype)
        if self._colour is not None:
            _store(context, self._colour.glo, format_, size, several)
        self.target = self._resolved if self._colour is None else gl.framebuffer([self._colour], self._depth)
        self.part: Box | None = None
        self._gl = gl

    def begin(self, background: tuple[float, float, float, float], part: Box | None = None) -> None:
        """Binds it, with every pixel at the background (4 numbers) and as far away as can be (reversed depth: 0).

        part: all that is drawn, to the same bits as when the whole is: a scissor's place has no side effects (OpenGL 4.6 core,
        A.3, rule 2).
        """
        self.part = part
        self.target.scissor = part  # type: ignore[assignment]
        self.target.use()
        self.target.clear(*background, depth=0.0)

    def resolve(self) -> moderngl.Texture:
        """The colours, one a pixel."""
        if self.target is not self._resolved:
            self._gl.copy_framebuffer(self._resolved, self.target)
        return self.texture

    def readback(self, out: NDArray[Any], corner: tuple[int, int] = (0, 0)) -> None:
        """Fills out (H, W, 4), uint8 or float32 and contiguous, row 0 at the top, with what lies at the corner."""
        self.resolve()
        height, width, _ = out.shape
        dtype = "f1" if out.dtype == np.uint8 else "f4"
        self._resolved.read_into(out, (*corner, width, height), components=4, alignment=1, dtype=dtype)


def _store(context: Context, renderbuffer: int, format_: int, size: tuple[int, int], samples: int) -> None:
    """Gives a renderbuffer storage of an internal format that moderngl has no name for."""
    bind = context.procedure("glBindRenderbuffer", None, ctypes.c_uint, ctypes.c_uint)
    # target, samples, format, width, height
    store = context.procedure(
        "glRenderbufferStorageMultisample", None, ctypes.c_uint, ctypes.c_int, ctypes.c_uint, ctypes.c_int, ctypes.c_int
    )
    if bind is not None and store is not None:
        bind(GL_RENDERBUFFER, renderbuffer)
        store(GL_RENDERBUFFER, samples, format_, *size)
