"""Canvas: the framebuffer of the OffscreenRenderer, with 8-bit colours, several samples a pixel and a readable depth."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.gl.frame import GL_DEPTH_COMPONENT32F, store

if TYPE_CHECKING:
    from glshade.gl.context import Context
    from glshade.scene.camera import View

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]
# OpenGL enumerants that moderngl does not name.
GL_READ_FRAMEBUFFER, GL_DRAW_FRAMEBUFFER, GL_DEPTH_BUFFER_BIT, GL_NEAREST = 0x8CA8, 0x8CA9, 0x100, 0x2600


class Canvas:
    """A framebuffer that is drawn the right way up, unlike glshade's own frames.

    As in pyrender, the samples of a pixel are averaged after encoding, and the pixel's depth is that of its first sample.

    size: width, height [pixels].
    target: the framebuffer to draw into.
    """

    def __init__(self, context: Context, size: tuple[int, int], samples: int, coloured: bool = True) -> None:
        """Creates the framebuffer.

        size: width, height [pixels].
        samples: the number of samples in a pixel; a single sample is in the middle.
        coloured: False for a framebuffer of depth alone, which is drawn in half the time.
        Errors: GlshadeError where the size is more than the driver allows.
        """
        if max(size) > context.largest_side:
            raise GlshadeError(f"a viewport of {size[0]} x {size[1]} is more than the driver's {context.largest_side} pixels")
        gl = context.gl
        whole, mask = [ctypes.c_int] * 8, [ctypes.c_uint] * 2
        self._bind = context.procedure("glBindFramebuffer", None, ctypes.c_uint, ctypes.c_uint)
        self._blit = context.procedure("glBlitFramebuffer", None, *whole, *mask)
        # moderngl cannot copy depth without colours. For that the two OpenGL functions above are needed.
        self._coloured = coloured or self._bind is None or self._blit is None
        several = 0 if samples == 1 else min(samples, gl.max_samples)
        self.size = size
        self.target = _framebuffer(context, size, several, self._coloured)
        self._resolved = _framebuffer(context, size, 0, self._coloured) if several else self.target
        self._gl = gl

    def begin(self, background: tuple[float, ...]) -> None:
        """Binds the framebuffer and clears it to a background (4,) at the far plane, which reversed depth puts at 0."""
        self.target.use()
        self.target.clear(*background, depth=0.0)

    @contextmanager
    def without_colours(self) -> Iterator[None]:
        """Returns a context manager within which only depth is drawn."""
        # moderngl applies a mask only when the framebuffer is bound.
        self.target.color_mask = (False,) * 4
        self.target.use()
        try:
            yield
        finally:
            self.target.color_mask = (True,) * 4
            self.target.use()

    def resolve(self) -> None:
        """Reduces the samples of each pixel to one colour and one depth."""
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
        """Returns the colours (H, W, channels), row 0 at the top."""
        pixels = np.empty((self.size[1], self.size[0], channels), dtype=np.uint8)
        self._resolved.read_into(pixels, components=channels, alignment=1)
        return np.ascontiguousarray(pixels[::-1])

    def depth(self, view: View, unit: float, planes: tuple[float, float | None] | None = None) -> Floats:
        """Returns the distances (H, W) along the view axis [scene units], row 0 at the top. They are 0 where nothing is drawn.

        view: the view that the picture was drawn with.
        unit: the length of the view's unit [scene units].
        planes: the near and the far plane with which pyrender converts depth as if the view were a perspective one; None for
            the distance itself.
        """
        pixels = np.empty((self.size[1], self.size[0]), dtype=np.float32)
        self._resolved.read_into(pixels, attachment=-1, components=1, alignment=1, dtype="f4")
        d = np.ascontiguousarray(pixels[::-1])
        near, far = np.float32(view.near * unit), np.float32(view.far * unit)
        empty = d == 0
        if planes is not None:
            # An infinite far plane has the inverse 0.
            nearest, inverse = np.float32(planes[0]), np.float32(1 / planes[1] if planes[1] else 0)
            np.divide(nearest, d + (1 - d) * nearest * inverse, out=d, where=~empty)
        # Invert the projection, which maps the near plane to 1 and the far plane to 0.
        elif view.perspective:
            d *= (far - near) / near
            d += 1
            np.divide(far, d, out=d)
        else:
            d *= near - far
            d += far
        d[empty] = 0
        return d


def _framebuffer(context: Context, size: tuple[int, int], samples: int, coloured: bool) -> Any:
    """Returns moderngl's framebuffer. samples: 0 for a single sample in the middle of each pixel."""
    gl = context.gl
    depth = gl.depth_renderbuffer(size, samples=samples)
    # moderngl allocates 24 bits of integer depth. Reversed depth has its precision near 0 and needs floats.
    store(context, depth.glo, GL_DEPTH_COMPONENT32F, size, samples)
    return gl.framebuffer([gl.renderbuffer(size, 4, samples=samples)] if coloured else [], depth)
