"""EGL: the library, and the context that is current in a thread."""

from __future__ import annotations

import ctypes
from typing import TypeAlias

from glshade.errors import ContextError
from glshade.gl.exclusive import note_driver
from glshade.gl.mesa_cache import reserve_index

LIBEGL = "libEGL.so.1"
ADVICE = "install a driver (Debian, Ubuntu: apt install libegl1 libgl1-mesa-dri), then see `glshade doctor`"
# Khronos' registry values (egl.xml).
EGL_DRAW, EGL_READ = 0x3059, 0x305A

# Display, surfaces to draw to and to read from, and context.
Current: TypeAlias = tuple[int | None, int | None, int | None, int | None]


def load_egl() -> ctypes.CDLL:
    """Returns the EGL library. Errors: ContextError if it is missing."""
    reserve_index()
    note_driver()
    try:
        return ctypes.CDLL(LIBEGL)
    except OSError as error:
        raise ContextError(f"{LIBEGL} cannot be loaded ({error}); {ADVICE}") from None


class EglCurrency:
    """The context of EGL that is current in a thread. Another library in this process may have made it."""

    def __init__(self) -> None:
        """Errors: ContextError without EGL."""
        pointer, integer = ctypes.c_void_p, ctypes.c_int
        egl = load_egl()
        self._display = ctypes.CFUNCTYPE(pointer)(("eglGetCurrentDisplay", egl))
        self._context = ctypes.CFUNCTYPE(pointer)(("eglGetCurrentContext", egl))
        self._surface = ctypes.CFUNCTYPE(pointer, integer)(("eglGetCurrentSurface", egl))
        self._make_current = ctypes.CFUNCTYPE(ctypes.c_uint, pointer, pointer, pointer, pointer)(("eglMakeCurrent", egl))

    def current(self) -> Current | None:
        """Returns the context that is current; None where none is."""
        context = self._context()
        if not context:
            return None
        return self._display(), self._surface(EGL_DRAW), self._surface(EGL_READ), context

    def restore(self, current: Current | None) -> None:
        """Makes a context current again, or none."""
        if current is not None:
            self._make_current(*current)
        elif display := self._display():
            self._make_current(display, None, None, None)
