"""OSMesa: Mesa's off-screen library, for machines without EGL. Legacy: Mesa 25.1 removed it.

moderngl takes it as a `context=` object, with the four methods that its own contexts have.
"""

from __future__ import annotations

import ctypes
from typing import Any

from glshade.errors import ContextError

LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6")
# GL/osmesa.h
OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS = 0x22, 0x1908, 0x30
OSMESA_PROFILE, OSMESA_CORE_PROFILE = 0x33, 0x34
OSMESA_CONTEXT_MAJOR_VERSION, OSMESA_CONTEXT_MINOR_VERSION = 0x36, 0x37
GL_UNSIGNED_BYTE = 0x1401


def load() -> ctypes.CDLL:
    """The library. Errors: ContextError where it is missing."""
    for name in LIBRARIES:
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    raise ContextError(f"{LIBRARIES[0]} cannot be loaded; apt install libosmesa6 (Mesa 25.1 and later have none)")


class OSMesa:
    """One context. It wants a colour buffer to be current, which nobody draws into: frames are textures."""

    def __init__(self, version: int) -> None:
        self._library = load()
        void, integer = ctypes.c_void_p, ctypes.c_int
        self._library.OSMesaCreateContextAttribs.restype = void
        self._library.OSMesaCreateContextAttribs.argtypes = [ctypes.POINTER(integer), void]
        self._library.OSMesaGetProcAddress.restype = void
        self._library.OSMesaGetProcAddress.argtypes = [ctypes.c_char_p]
        self._library.OSMesaMakeCurrent.argtypes = [void, void, ctypes.c_uint, integer, integer]
        self._library.OSMesaDestroyContext.argtypes = [void]
        wanted = {
            OSMESA_FORMAT: OSMESA_RGBA,
            OSMESA_DEPTH_BITS: 24,
            OSMESA_PROFILE: OSMESA_CORE_PROFILE,
            OSMESA_CONTEXT_MAJOR_VERSION: version // 100,
            OSMESA_CONTEXT_MINOR_VERSION: version % 100 // 10,
        }
        flat = [number for pair in wanted.items() for number in pair] + [0]
        self._context = self._library.OSMesaCreateContextAttribs((integer * len(flat))(*flat), None)
        self._buffer = (ctypes.c_ubyte * 4)()
        if not self._context or not self._make_current():
            raise ContextError(f"OSMesa gives no OpenGL {version / 100:.1f} context")

    def _make_current(self) -> bool:
        return bool(self._library.OSMesaMakeCurrent(self._context, self._buffer, GL_UNSIGNED_BYTE, 1, 1))

    def load_opengl_function(self, name: str) -> int:
        """The address of a GL function, 0 where there is none."""
        return self._library.OSMesaGetProcAddress(name.encode()) or 0

    def __enter__(self) -> None:
        self._make_current()

    def __exit__(self, *unused: Any) -> None:
        # Whoever draws next enters first.
        pass

    def release(self) -> None:
        """Destroys the context."""
        if self._context:
            self._library.OSMesaDestroyContext(self._context)
            self._context = None
