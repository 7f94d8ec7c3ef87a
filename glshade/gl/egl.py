"""EGL: the library, and the context that is current in a thread."""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress
from threading import Thread
from typing import TypeAlias

from glshade.errors import ContextError
from glshade.gl.exclusive import note_driver
from glshade.gl.mesa_cache import reserve_index

LIBEGL = "libEGL.so.1"
ADVICE = "install a driver (Debian, Ubuntu: apt install libegl1 libgl1-mesa-dri), then see `glshade doctor`"
# Khronos' registry values (egl.xml).
EGL_DRAW, EGL_READ = 0x3059, 0x305A
EGL_PLATFORM_DEVICE = 0x313F

# Display, surfaces to draw to and to read from, and context.
Current: TypeAlias = tuple[int | None, int | None, int | None, int | None]


# The thread that `load_ahead` has started; None before.
_ahead: Thread | None = None


def load_ahead() -> None:
    """Begins to load the driver in a thread, while this one imports modules or reads a scene.

    It loads the driver of EGL's first device, which is the one that a context gets by default. It tells no errors: whoever
    opens a context gets them. It does nothing on systems other than Linux.
    """
    global _ahead
    if _ahead is None and sys.platform.startswith("linux"):
        _ahead = Thread(target=_initialise, name="driver", daemon=True)
        _ahead.start()


def _initialise() -> None:
    """Initialises the display of EGL's first device, for which Mesa loads its driver. Other threads run meanwhile."""
    pointer, integer = ctypes.c_void_p, ctypes.c_int
    with suppress(OSError, ValueError, ContextError):
        egl = _library()
        egl.eglGetProcAddress.restype = pointer
        query = ctypes.CFUNCTYPE(ctypes.c_uint, integer, pointer, pointer)(_address(egl, b"eglQueryDevicesEXT"))
        display_of = ctypes.CFUNCTYPE(pointer, ctypes.c_uint, pointer, pointer)(_address(egl, b"eglGetPlatformDisplayEXT"))
        initialise = ctypes.CFUNCTYPE(ctypes.c_uint, pointer, pointer, pointer)(("eglInitialize", egl))
        device, count = pointer(), integer()
        if query(1, ctypes.byref(device), ctypes.byref(count)) and count.value:
            initialise(display_of(EGL_PLATFORM_DEVICE, device, None), None, None)


def _address(egl: ctypes.CDLL, name: bytes) -> int:
    """Returns the address of a function. Errors: ValueError if EGL does not have it."""
    address = egl.eglGetProcAddress(name)
    if not address:
        raise ValueError(name)
    return int(address)


def load_egl() -> ctypes.CDLL:
    """Returns the EGL library, after `load_ahead` has finished. Errors: ContextError if it is missing."""
    if _ahead is not None:
        _ahead.join()
    return _library()


def _library() -> ctypes.CDLL:
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
