"""OSMesa: contexts of Mesa's off-screen library, for machines without EGL. Mesa 25.1 removed the library.

The class OSMesa has the four methods that moderngl needs of an object for its argument `context=`.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import threading
from pathlib import Path

from glshade.errors import ContextError
from glshade.gl.mesa_cache import reserve_index

LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6")
# The values are those of GL/osmesa.h.
OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS = 0x22, 0x1908, 0x30
OSMESA_PROFILE, OSMESA_CORE_PROFILE = 0x33, 0x34
OSMESA_CONTEXT_MAJOR_VERSION, OSMESA_CONTEXT_MINOR_VERSION = 0x36, 0x37
GL_UNSIGNED_BYTE = 0x1401


def check_driver() -> None:
    """Makes a context in another process, because OSMesa crashes if $GALLIUM_DRIVER names a driver that does not exist.

    Errors: ContextError if the other process crashes.
    """
    root = str(Path(__file__).resolve().parents[2])
    # -S leaves out site-packages: the other process needs nothing but this file, and starts three times as fast.
    command = [sys.executable, "-S", "-P", "-m", "glshade.gl.osmesa"]
    code = subprocess.run(command, env={**os.environ, "PYTHONPATH": root}, capture_output=True, check=False).returncode
    if code < 0:
        raise ContextError(f"OSMesa's driver crashes: is GALLIUM_DRIVER={os.environ.get('GALLIUM_DRIVER', '')} right?")


def load() -> ctypes.CDLL:
    """Returns the OSMesa library. Errors: ContextError if it is missing."""
    reserve_index()
    for name in LIBRARIES:
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    raise ContextError(f"{LIBRARIES[0]} cannot be loaded; apt install libosmesa6 (Mesa 25.1 and later have none)")


# The context of OSMesa that is current in each thread.
_current = threading.local()


class OSMesa:
    """One OSMesa context. OSMesa needs a colour buffer, so it gets one of a single pixel; glshade draws into textures."""

    def __init__(self, version: int) -> None:
        """Makes a context, which is current afterwards.

        version: the least version of OpenGL in moderngl's notation, for example 330.
        Errors: ContextError.
        """
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
        _current.context = self
        return bool(self._library.OSMesaMakeCurrent(self._context, self._buffer, GL_UNSIGNED_BYTE, 1, 1))

    def load_opengl_function(self, name: str) -> int:
        """Returns the address of a GL function, 0 if the driver does not have it."""
        return self._library.OSMesaGetProcAddress(name.encode()) or 0

    def __enter__(self) -> None:
        self._make_current()

    def current(self) -> OSMesa | None:
        """Returns the context that is current in this thread, if it is one of this class."""
        return _current.__dict__.get("context")

    def restore(self, current: OSMesa | None) -> None:
        """Makes a context current again.

        Without one, the context stays current: every context is entered before it is used, and one thread at a time uses it.
        Without any current context, OSMesa crashes where a driver of EGL does nothing.
        """
        if current is not None:
            current._make_current()

    def release(self) -> None:
        """Destroys the context."""
        if self._context:
            before = self.current()
            # Mesa takes a context's objects apart in the context that is current.
            self._make_current()
            self._library.OSMesaDestroyContext(self._context)
            self._context = _current.context = None
            if before is not None and before is not self:
                before._make_current()


if __name__ == "__main__":
    # This is the other process of `check_driver`.
    OSMesa(330)
