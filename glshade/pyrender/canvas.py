"""Canvas: what the drop-in draws into: four samples a pixel of 8 bits, as in pyrender, and a depth that can be read."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.gl.frame import GL_DEPTH_COMPONENT32F, _store

if TYPE_CHECKING:
    from glshade.gl.context import Context
    from glshade.scene.camera import View

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]
SAMPLES = 4
GL_READ_FRAMEBUFFER, GL_DRAW_FRAMEBUFFER, GL_DEPTH_BUFFER_BIT, GL_NEAREST = 0x8CA8, 0x8CA9, 0x100, 0x2600


class Canvas:
    """A picture of `size` (width, height) with one sample in the middle of each pixel, or with SAMPLES.

    It is drawn the right way up. Samples are averaged as they are shown, and the depth is the first one's. Without colours it
    holds depth alone, at half the cost. Errors: GlshadeError where it is too large.
    """

    def __init__(self, context: Context, size: tuple[int, int], samples: int, coloured: bool = True) -> None:
        if max(size) > context.largest_side:
            raise GlshadeError(f"a viewport of {size[0]} x {size[1]} is more than the driver's {context.largest_side} pixels")
        gl = context.gl
        whole, mask = [ctypes.c_int] * 8, [ctypes.c_uint] * 2
        self._bind = context.procedure("glBindFramebuffer", None, ctypes.c_uint, ctypes.c_uint)
        self._blit = context.procedure("glBlitFramebuffer", None, *whole, *mask)
        # moderngl copies depth together with colours alone.
        self._coloured = coloured or self._bind is None or self._blit is None
        several = 0 if samples == 1 else min(samples, gl.max_samples)
        self.size = size
        self.target = _framebuffer(context, size, several, self._coloured)
        self._resolved = _framebuffer(context, size, 0, self._coloured) if several else self.target
        self._gl = gl

    def begin(self, background: tuple[float, ...]) -> None:
        """Binds it, with every pixel at the background (4 numbers) and as far away as can be (reversed depth: 0)."""
        self.target.use()
        self.target.clear(*background, depth=0.0)

    @contextmanager
    def without_colours(self) -> Iterator[None]:
        """Within it depth alone is drawn."""
        # moderngl applies a mask when the framebuffer is bound.
        self.target.color_mask = (False,) * 4
        self.target.use()
        try:
            yield
        finally:
            self.target.color_mask = (True,) * 4
            self.target.use()

    def resolve(self) -> None:
        """One colour and one depth a pixel."""
        if self._resolved is self.target:
            return
        if self._coloured:
            self._gl.copy_framebuffer(self._resolved, self.target)
        elif self._bind is not None and self._blit is not None:
            self._bind(GL_READ_FRAMEBUFFER, self.target.glo)
            self._bind(GL_DRAW_FRAMEBUFFER, self._resolved.glo)
            whole = (0, 0, *self.size)
            self._blit(*whole, *whole, GL_DEPTH_BUFFER_BIT, GL_NEAREST)

    def colour(self, channels: int) -> Bytes:
        """(H, W, channels), row 0 at the top."""
        pixels = np.empty((self.size[1], self.size[0], channels), dtype=np.uint8)
        self._resolved.read_into(pixels, components=channels, alignment=1)
        return np.ascontiguousarray(pixels[::-1])

    def depth(self, view: View, unit: float) -> Floats:
        """(H, W), row 0 at the top: along the view axis [scene units], 0 where nothing is. unit: of the view's lengths."""
        pixels = np.empty((self.size[1], self.size[0]), dtype=np.float32)
        self._resolved.read_into(pixels, attachment=-1, components=1, alignment=1, dtype="f4")
        d = np.ascontiguousarray(pixels[::-1])
        near, far = np.float32(view.near * unit), np.float32(view.far * unit)
        empty = d == 0
        # The projection undone: 1 at the near plane, 0 at the far one.
        if view.perspective:
            d *= (far - near) / near
            d += 1
            np.divide(far, d, out=d)
        else:
            d *= near - far
            d += far
        d[empty] = 0
        return d


def _framebuffer(context: Context, size: tuple[int, int], samples: int, coloured: bool) -> Any:
    gl = context.gl
    depth = gl.depth_renderbuffer(size, samples=samples)
    # 32 bits, where reversed depth has its digits; moderngl makes 24.
    _store(context, depth.glo, GL_DEPTH_COMPONENT32F, size, samples)
    return gl.framebuffer([gl.renderbuffer(size, 4, samples=samples)] if coloured else [], depth)
