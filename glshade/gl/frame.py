"""Frame: what the GPU draws into. Samples are resolved, and pixels are read back, here."""

from __future__ import annotations

import ctypes
from typing import Any, Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.gl.context import Context

GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F = 0x8D41, 0x8CAC
Storage = Literal["rgba8", "rgba32f"]
DTYPES: dict[Storage, tuple[str, Any]] = {"rgba8": ("f1", np.uint8), "rgba32f": ("f4", np.float32)}


class Frame:
    """A colour and a depth buffer of one size.

    rgba8 for pictures to look at, drawn encoded; rgba32f for linear light. With several samples a pixel the colours are
    averaged, in linear light, when they are read or passed on.
    """

    def __init__(self, context: Context, size: tuple[int, int], storage: Storage, samples: int = 1) -> None:
        gl = context.gl
        self.size, self.storage, self.samples = size, storage, samples
        dtype, self.dtype = DTYPES[storage]
        self.texture = gl.texture(size, 4, dtype=dtype)
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        several = 0 if samples == 1 else samples
        self._depth = gl.depth_renderbuffer(size, samples=several)
        _make_float(context, self._depth.glo, size, several)
        self._resolved = gl.framebuffer([self.texture], self._depth if samples == 1 else None)
        self._colour = None if samples == 1 else gl.renderbuffer(size, 4, samples=several, dtype=dtype)
        self.target = self._resolved if self._colour is None else gl.framebuffer([self._colour], self._depth)
        self._gl = gl

    def begin(self, background: tuple[float, float, float, float]) -> None:
        """Binds it, with every pixel at the background (4 numbers) and as far away as can be (reversed depth: 0)."""
        self.target.use()
        self.target.clear(*background, depth=0.0)

    def resolve(self) -> moderngl.Texture:
        """The colours, one a pixel."""
        if self.target is not self._resolved:
            self._gl.copy_framebuffer(self._resolved, self.target)
        return self.texture

    def readback(self, out: NDArray[Any]) -> None:
        """Fills out (H, W, 4), of the storage's dtype and contiguous, row 0 at the top."""
        self.resolve()
        self._resolved.read_into(out, components=4, alignment=1, dtype=DTYPES[self.storage][0])


def _make_float(context: Context, renderbuffer: int, size: tuple[int, int], samples: int) -> None:
    """Gives a depth renderbuffer 32-bit float storage, where reversed depth has its digits; moderngl makes 24-bit ones."""
    bind = context.procedure("glBindRenderbuffer", None, ctypes.c_uint, ctypes.c_uint)
    # target, samples, format, width, height
    store = context.procedure(
        "glRenderbufferStorageMultisample", None, ctypes.c_uint, ctypes.c_int, ctypes.c_uint, ctypes.c_int, ctypes.c_int
    )
    if bind is not None and store is not None:
        bind(GL_RENDERBUFFER, renderbuffer)
        store(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT32F, *size)
