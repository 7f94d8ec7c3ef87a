"""Context: OpenGL contexts without a window, and access to GL functions that moderngl does not wrap.

On Linux, contexts are made with EGL; the library is loaded as `libEGL.so.1`, because the unversioned name exists only where
development packages are installed. Without EGL, `auto` falls back to Mesa's OSMesa (osmesa.py). On other systems `auto` takes
moderngl's own standalone context. One process can use only one backend.
"""

from __future__ import annotations

import ctypes
import os
import re
import sys
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import glcontext
import moderngl

from glshade.errors import ContextError
from glshade.gl.egl import ADVICE, LIBEGL, EglCurrency, load_egl
from glshade.gl.exclusive import Exclusive, note_driver

if TYPE_CHECKING:
    from glshade.gl.linker import Linker

Backend = Literal["auto", "egl", "osmesa", "standalone"]
# What moderngl raises where OpenGL refuses a call, for modules outside of this room.
DriverFault: type[Exception] = moderngl.Error
BACKENDS: tuple[Backend, ...] = ("auto", "egl", "osmesa", "standalone")
# OpenGL 3.3, in moderngl's notation.
REQUIRED_VERSION = 330

# Khronos' registry values (gl.xml, egl.xml).
GL_LOWER_LEFT, GL_ZERO_TO_ONE = 0x8CA1, 0x935F
GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T = 0x0DE1, 0x2802, 0x2803
EGL_VENDOR, EGL_VERSION, EGL_EXTENSIONS = 0x3053, 0x3054, 0x3055
EGL_PLATFORM_DEVICE_EXT = 0x313F

# Parts of the GL_RENDERER strings, in lower case, of renderers that run on the CPU.
SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "software rasterizer")

# The environment variables that choose a driver. A wrong value looks like a missing driver.
CHOOSING = ("GALLIUM_DRIVER", "MESA_LOADER_DRIVER_OVERRIDE", "LIBGL_DRIVERS_PATH", "__EGL_VENDOR_LIBRARY_FILENAMES")
# llvmpipe's GL_RENDERER string ends with the width of its vectors. Mesa 22.3 crashes when it draws with another width than
# these, which only the environment variable LP_NATIVE_VECTOR_WIDTH can ask for [bits].
WIDTH, WIDTHS = re.compile(r"llvmpipe.* (\d+) bits"), ("128", "256")


@dataclass(frozen=True)
class Device:
    """One of EGL's devices.

    index: its number in EGL's list, which `--device` takes.
    vendor: EGL_VENDOR.
    version: EGL_VERSION.
    extensions: the names of its device extensions.
    """

    index: int
    vendor: str
    version: str
    extensions: tuple[str, ...]

    @property
    def is_software(self) -> bool:
        """Whether the device renders on the CPU."""
        return "EGL_MESA_device_software" in self.extensions


# The backends on which this process has opened contexts.
_opened: set[str] = set()


class Context:
    """An OpenGL context. It is current after its creation.

    backend: egl, osmesa or standalone.
    linker: loads programs from the disk cache; None if the cache is off or the driver offers no program binaries.
    zero_to_one: whether clip z runs from 0 to 1. Reversed float depth gains precision only with this range.
    """

    def __init__(
        self,
        gl: moderngl.Context,
        backend: str,
        procedure: Callable[[str], int | None],
        linker: Linker | None = None,
        window: Exclusive | None = None,
    ) -> None:
        self._gl, self.backend, self.linker = gl, backend, linker
        self._procedure, self._window = procedure, window
        # Only gc() deletes the GL objects that Python no longer uses, and it runs while this context is current. In another
        # context the same number may name an object that is in use.
        gl.gc_mode = "context_gc"
        # A context that is forgotten is destroyed like one that is released.
        self._release = weakref.finalize(self, _destroy, gl, linker)
        # The info is read now, while the context is current. Later it may be empty, and moderngl would cache the empty info.
        self._info = gl.info
        clip_control = self.procedure("glClipControl", None, ctypes.c_uint, ctypes.c_uint)
        self.zero_to_one = clip_control is not None and (gl.version_code >= 450 or "GL_ARB_clip_control" in gl.extensions)
        if self.zero_to_one and clip_control is not None:
            clip_control(GL_LOWER_LEFT, GL_ZERO_TO_ONE)

    @property
    def gl(self) -> moderngl.Context:
        """moderngl's context. Errors: ContextError after `release`."""
        self.check_open()
        return self._gl

    def check_open(self) -> None:
        """Checks that the context may be used. Errors: ContextError after `release`."""
        if not self._release.alive:
            raise ContextError("the OpenGL context, or the Renderer that had it, has been released: make a new one")

    @property
    def renderer(self) -> str:
        """The driver's GL_RENDERER string."""
        return str(self._info["GL_RENDERER"])

    @property
    def version(self) -> str:
        """The driver's GL_VERSION string."""
        return str(self._info["GL_VERSION"])

    @property
    def is_software(self) -> bool:
        """Whether the driver renders on the CPU."""
        return any(name in self.renderer.lower() for name in SOFTWARE)

    @property
    def passed_vectors(self) -> int:
        """The number of vectors that the vertex stage can pass to the fragment stage; OpenGL 3.3 guarantees 15."""
        return int(self._info.get("GL_MAX_VARYING_VECTORS", 15))

    @property
    def largest_side(self) -> int:
        """The largest width and height of a frame [pixels]."""
        info = self._info
        return int(min(info["GL_MAX_TEXTURE_SIZE"], info["GL_MAX_RENDERBUFFER_SIZE"], *info["GL_MAX_VIEWPORT_DIMS"]))

    def procedure(self, name: str, result: Any, *arguments: Any) -> Callable[..., Any] | None:
        """Returns a GL function that moderngl does not wrap; None if the driver does not have it.

        name: the name of the function.
        result: the ctypes type of its result; None if it returns nothing.
        arguments: the ctypes types of its arguments.
        """
        address = self._procedure(name)
        return ctypes.CFUNCTYPE(result, *arguments)(address) if address else None

    def leave(self) -> None:
        """Lets other threads enter a new context, which is current in the thread that made it."""
        if self._window is not None:
            self._window.leave()

    def release(self) -> None:
        """Destroys the context and all of its objects. A second call does nothing."""
        self._release()


def _destroy(gl: moderngl.Context, linker: Linker | None) -> None:
    """Destroys a context and all of its objects."""
    # moderngl does not free the set of the extensions' names, nor the linker.
    gl.extensions.clear()
    if linker is not None:
        linker.forget()
    gl.release()


def open_context(backend: Backend = "auto", device: int | None = None, program_cache: bool | None = None) -> Context:
    """Opens a new context, which is current afterwards.

    backend: auto, egl, osmesa or standalone.
    device: optional; the index of an EGL device.
    program_cache: optional; whether linked programs are cached on disk. Default: they are, unless the environment variable
        GLSHADE_PROGRAM_CACHE is "0". A standalone context never has this cache.
    Errors: ContextError, which names the failure and its remedy.
    """
    if backend not in BACKENDS:
        raise ContextError(f"unknown backend {backend!r}; allowed: {', '.join(BACKENDS)}")
    cached = os.environ.get("GLSHADE_PROGRAM_CACHE") != "0" if program_cache is None else program_cache
    on_linux = sys.platform.startswith("linux")
    if backend == "egl" or (backend == "auto" and on_linux):
        try:
            return _open_egl(device, cached)
        except ContextError as error:
            if backend == "egl" or device is not None:
                raise
            return _open_osmesa(cached, instead_of=error)
    if backend == "osmesa":
        if device is not None:
            raise ContextError("only EGL has devices to choose from; leave --device out")
        return _open_osmesa(cached)
    if device is not None:
        raise ContextError("only EGL has devices to choose from; leave --device out")
    try:
        gl = moderngl.create_context(standalone=True, require=REQUIRED_VERSION)
    except Exception as error:
        raise ContextError(f"no OpenGL {REQUIRED_VERSION / 100:.1f} context from the window system: {error}") from None
    return Context(gl, "standalone", lambda name: None)


def _open_egl(device: int | None, cached: bool) -> Context:
    egl = load_egl()
    # glcontext looks up GL symbols in a libGL. EGL's own library serves as well, and minimal machines have no libGL.
    options: dict[str, Any] = {"mode": "standalone", "libegl": LIBEGL, "libgl": LIBEGL, "glversion": REQUIRED_VERSION}
    if device is not None:
        options["device_index"] = device
    try:
        window = glcontext.get_backend_by_name("egl")(**options)
        exclusive = Exclusive(window, EglCurrency())
        gl, linker = _wrapped(exclusive, "egl", cached)
    except Exception as error:
        if device is not None:
            count = len(devices())
            if not 0 <= device < count:
                raise ContextError(f"there is no EGL device {device}: `glshade devices` lists {count}") from None
        chosen = [f"{name}={os.environ[name]}" for name in CHOOSING if name in os.environ]
        advice = f"check {', '.join(chosen)} in the environment, or {ADVICE}" if chosen else ADVICE
        raise ContextError(f"EGL gives no OpenGL {REQUIRED_VERSION / 100:.1f} context ({error}); {advice}") from None
    _opened.add("egl")

    def procedure(name: str) -> int | None:
        egl.eglGetProcAddress.restype = ctypes.c_void_p
        address: int | None = egl.eglGetProcAddress(name.encode())
        return address

    return _checked(Context(gl, "egl", procedure, linker, exclusive))


def _open_osmesa(cached: bool, instead_of: ContextError | None = None) -> Context:
    """Opens an OSMesa context.

    cached: whether linked programs are cached on disk.
    instead_of: optional; the error of EGL, which is raised in place of OSMesa's own if OSMesa is not available either.
    """
    # An EGL context leaves state in its thread; making an OSMesa context current afterwards crashes the driver.
    if "egl" in _opened:
        raise instead_of or ContextError("this process has used EGL already; OSMesa needs a process of its own")
    from glshade.gl.osmesa import OSMesa, check_driver

    note_driver()
    try:
        check_driver()
        own = OSMesa(REQUIRED_VERSION)
        exclusive = Exclusive(own, own)
    except ContextError as error:
        raise instead_of or error from None
    try:
        gl, linker = _wrapped(exclusive, "osmesa", cached)
    except Exception as error:
        raise ContextError(f"OSMesa gives no OpenGL {REQUIRED_VERSION / 100:.1f} context ({error})") from None
    _opened.add("osmesa")
    return _checked(Context(gl, "osmesa", own.load_opengl_function, linker, exclusive))


def _wrapped(window: Exclusive, backend: str, cached: bool) -> tuple[moderngl.Context, Linker | None]:
    """Returns a moderngl context around a context of glcontext or OSMesa, and the linker between them, or None without a
    linker.
    """
    linker = None
    if cached:
        from glshade.gl.binaries import Binaries
        from glshade.gl.linker import Linker

        linker = Linker(window, Binaries(), backend)
        if not linker.offers_binaries:
            linker = None
    settings: dict[str, Any] = {"context": linker or window, "require": REQUIRED_VERSION}
    return moderngl.create_context(standalone=True, **settings), linker


def _checked(context: Context) -> Context:
    """Returns a new context that can draw. Errors: ContextError for a width of vectors with which llvmpipe crashes."""
    width = WIDTH.match(context.renderer)
    if width and width[1] not in WIDTHS:
        context.release()
        raise ContextError(f"llvmpipe crashes with vectors of {width[1]} bits: set LP_NATIVE_VECTOR_WIDTH to 128 or 256")
    return context


def devices() -> list[Device]:
    """Returns the EGL devices, in EGL's order. Errors: ContextError without EGL or without its device extensions."""
    egl = load_egl()
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglQueryString.restype = ctypes.c_char_p

    def function(name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
        address = egl.eglGetProcAddress(name.encode())
        if not address:
            raise ContextError(
                f"{LIBEGL} has no {name}, so it cannot list devices: it has found no driver, or an old one; {ADVICE}"
            )
        return ctypes.CFUNCTYPE(result, *arguments)(address)

    pointer, integer = ctypes.c_void_p, ctypes.c_int
    query = function("eglQueryDevicesEXT", ctypes.c_uint, integer, ctypes.POINTER(pointer), ctypes.POINTER(integer))
    text = function("eglQueryDeviceStringEXT", ctypes.c_char_p, pointer, integer)
    display_of = function("eglGetPlatformDisplayEXT", pointer, ctypes.c_uint, pointer, ctypes.POINTER(integer))
    found = (pointer * 64)()
    count = integer()
    if not query(len(found), found, ctypes.byref(count)):
        raise ContextError(f"{LIBEGL} cannot list its devices; {ADVICE}")
    result = []
    for index in range(count.value):
        extensions = tuple((text(found[index], EGL_EXTENSIONS) or b"").decode().split())
        display = display_of(EGL_PLATFORM_DEVICE_EXT, found[index], None)
        vendor, version = "unknown", "unknown"
        major, minor = integer(), integer()
        if display and egl.eglInitialize(pointer(display), ctypes.byref(major), ctypes.byref(minor)):
            vendor = (egl.eglQueryString(pointer(display), EGL_VENDOR) or b"?").decode()
            version = (egl.eglQueryString(pointer(display), EGL_VERSION) or b"?").decode()
        result.append(Device(index, vendor, version, extensions))
    return result
