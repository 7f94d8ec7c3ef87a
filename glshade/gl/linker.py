"""Linker: makes moderngl programs from binaries in the disk cache (glGetProgramBinary, glProgramBinary).

moderngl compiles, links and inspects a program in one call, and has no interface for binaries. But it asks its context for the
address of every GL function. The Linker takes the place of the context and returns functions of its own for three of them:
while it loads a binary, compiling does nothing, and linking loads the binary. docs/decisions/0008-program-binaries.md has the
measured gain.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import moderngl

from glshade.gl.binaries import Binaries, Binary
from glshade.version import __version__

# Khronos' registry values (gl.xml).
GL_VENDOR, GL_RENDERER, GL_VERSION = 0x1F00, 0x1F01, 0x1F02
GL_NUM_PROGRAM_BINARY_FORMATS, GL_PROGRAM_BINARY_FORMATS = 0x87FE, 0x87FF
GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_PROGRAM_BINARY_LENGTH = 0x8257, 0x8741
GL_COMPILE_STATUS, GL_LINK_STATUS = 0x8B81, 0x8B82

# The beginnings of the names of Mesa's environment variables, many of which change the code that it generates.
MESA = ("DRAW_", "GALLIUM_", "GALLIVM_", "LP_", "MESA_", "NIR_", "SOFTPIPE_", "ST_")
# The variables of these beginnings that change no code: where and whether Mesa caches, what it logs, and with how many threads
# it draws.
HARMLESS = ("LP_NUM_THREADS", "MESA_GLSL_CACHE_", "MESA_LOG", "MESA_SHADER_CACHE_")

_uint, _int, _pointer = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p
_SIGNATURES: dict[str, Any] = {
    "glCompileShader": ctypes.CFUNCTYPE(None, _uint),
    "glGetAttachedShaders": ctypes.CFUNCTYPE(None, _uint, _int, _pointer, _pointer),
    "glGetError": ctypes.CFUNCTYPE(_uint),
    "glGetIntegerv": ctypes.CFUNCTYPE(None, _uint, _pointer),
    "glGetProgramBinary": ctypes.CFUNCTYPE(None, _uint, _int, _pointer, _pointer, _pointer),
    "glGetProgramiv": ctypes.CFUNCTYPE(None, _uint, _uint, _pointer),
    "glGetShaderiv": ctypes.CFUNCTYPE(None, _uint, _uint, ctypes.POINTER(_int)),
    "glGetString": ctypes.CFUNCTYPE(ctypes.c_char_p, _uint),
    "glLinkProgram": ctypes.CFUNCTYPE(None, _uint),
    "glProgramBinary": ctypes.CFUNCTYPE(None, _uint, _uint, _pointer, _int),
    "glProgramParameteri": ctypes.CFUNCTYPE(None, _uint, _uint, _int),
}


class Linker:
    """A context object for moderngl that wraps the one of glcontext or OSMesa.

    offers_binaries: whether the driver supports program binaries; if not, the Linker must not be used.
    """

    def __init__(self, window: Any, binaries: Binaries, backend: str) -> None:
        """Asks the driver for its binary formats.

        window: the context object that moderngl would otherwise get as `context=`. It must be current.
        binaries: the disk cache.
        backend: the name of the backend, which is part of the cache's keys.
        """
        self._window, self._binaries = window, binaries
        # The state of one call of _make(): the binary to load in place of compiling, whether the driver accepted it, and the
        # exception that a callback raised.
        self._binary_to_load: Binary | None = None
        self._accepted = False
        self._raised: BaseException | None = None
        self._gl: dict[str, Any] = {}
        for name, signature in _SIGNATURES.items():
            if address := window.load_opengl_function(name):
                self._gl[name] = signature(address)
        formats = self._formats() if len(self._gl) == len(_SIGNATURES) else []
        self.offers_binaries = bool(formats)
        self._driver = ""
        self._own: dict[str, Any] = {}
        if formats:
            names = [self._gl["glGetString"](name) or b"" for name in (GL_VENDOR, GL_RENDERER, GL_VERSION)]
            # The backend is part of the key: EGL and OSMesa load different libraries of the same driver, and neither needs to
            # accept the other's binaries.
            self._driver = repr((__version__, backend, names, formats, settings(os.environ), processor()))
            for name, own in (
                ("glCompileShader", self._compile),
                ("glGetShaderiv", self._ask_shader),
                ("glLinkProgram", self._link),
            ):
                self._own[name] = _SIGNATURES[name](self._storing_exceptions(own))

    def load_opengl_function(self, name: str) -> int:
        """Returns the address of a GL function, 0 if the driver does not have it."""
        own = self._own.get(name)
        return self._window.load_opengl_function(name) if own is None else ctypes.cast(own, _pointer).value or 0

    def __enter__(self) -> Any:
        return self._window.__enter__()

    def __exit__(self, *unused: Any) -> Any:
        return self._window.__exit__(*unused)

    def release(self) -> None:
        """Destroys the context."""
        self._window.release()

    def forget(self) -> None:
        """Frees everything but the context object, which must not be used afterwards except to release it."""
        self._gl.clear()
        self._own.clear()

    def program(self, gl: moderngl.Context, vertex: str, fragment: str | None) -> moderngl.Program:
        """Returns the linked program of two texts, from the disk cache if it is there; else it is compiled and added to the
        cache.

        gl: the moderngl context that was made with this Linker.
        vertex: the text of the vertex stage.
        fragment: the text of the fragment stage, None if there is none.
        Errors: moderngl.Error with the driver's message.
        """
        key = self.key(vertex, fragment)
        stored = self._binaries.recall(key)
        if stored:
            try:
                program = self._make(gl, vertex, fragment, stored)
            except moderngl.Error:
                # The driver rejected the binary, and the texts do not link either. Compiling them anew, below, gives the
                # messages that the compiler gives without a cache.
                stored = None
        if not stored:
            program = self._make(gl, vertex, fragment, None)
        if not self._accepted and (binary := self._binary(program.glo)):
            self._binaries.keep(key, binary)
        return program

    def key(self, vertex: str, fragment: str | None) -> str:
        """Returns the cache key of a program: a digest of its texts, the driver, the driver's formats and settings, the
        processor and glshade's version."""
        return hashlib.sha256("\0".join((self._driver, vertex, fragment or "")).encode()).hexdigest()

    def _make(self, gl: moderngl.Context, vertex: str, fragment: str | None, binary: Binary | None) -> moderngl.Program:
        """Returns the program, loaded from a binary if one is given and the driver accepts it, else compiled from its texts."""
        self._binary_to_load, self._accepted, self._raised = binary, False, None
        try:
            return gl.program(vertex, fragment)
        finally:
            self._binary_to_load = None
            if self._raised:
                raise self._raised

    def _storing_exceptions(self, function: Callable[..., None]) -> Callable[..., None]:
        """Returns a callback that stores the exceptions of a function, for _make() to raise: ctypes would only print them, so
        that a KeyboardInterrupt would be lost."""

        def called(*arguments: Any) -> None:
            try:
                function(*arguments)
            except BaseException as error:
                self._raised = error

        return called

    def _compile(self, shader: int) -> None:
        """Stands in for glCompileShader: does nothing while a binary is loaded."""
        if not self._binary_to_load:
            self._gl["glCompileShader"](shader)

    def _ask_shader(self, shader: int, name: int, value: Any) -> None:
        """Stands in for glGetShaderiv: moderngl must see a success for the shaders that were not compiled."""
        if self._binary_to_load and name == GL_COMPILE_STATUS:
            value[0] = 1
        else:
            self._gl["glGetShaderiv"](shader, name, value)

    def _link(self, program: int) -> None:
        """Stands in for glLinkProgram: loads the binary if the driver accepts it, and otherwise links the shaders."""
        if self._binary_to_load:
            kind, data = self._binary_to_load
            self._gl["glProgramBinary"](program, kind, data, len(data))
            self._accepted = bool(self._ask_program(program, GL_LINK_STATUS))
            if self._accepted:
                return
            # The rejection may have set the GL error. glGetError clears it, so that no later call sees it. After that, the
            # program is compiled.
            self._gl["glGetError"]()
            shaders, count = (_uint * 8)(), _int()
            self._gl["glGetAttachedShaders"](program, len(shaders), ctypes.byref(count), shaders)
            for shader in shaders[: count.value]:
                self._gl["glCompileShader"](shader)
        self._gl["glProgramParameteri"](program, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, 1)
        self._gl["glLinkProgram"](program)

    def _binary(self, program: int) -> Binary | None:
        """Returns the binary of a linked program; None if the driver gives none."""
        data = ctypes.create_string_buffer(self._ask_program(program, GL_PROGRAM_BINARY_LENGTH))
        kind, length = _uint(), _int()
        self._gl["glGetProgramBinary"](program, len(data), ctypes.byref(length), ctypes.byref(kind), data)
        return (kind.value, data.raw[: length.value]) if length.value > 0 else None

    def _formats(self) -> list[int]:
        """Returns the numbers of the driver's binary formats, in ascending order."""
        count = _int()
        self._gl["glGetIntegerv"](GL_NUM_PROGRAM_BINARY_FORMATS, ctypes.byref(count))
        formats = (_int * max(count.value, 0))()
        if count.value > 0:
            self._gl["glGetIntegerv"](GL_PROGRAM_BINARY_FORMATS, formats)
        return sorted(formats)

    def _ask_program(self, program: int, name: int) -> int:
        """Returns an integer property of a program (glGetProgramiv)."""
        value = _int()
        self._gl["glGetProgramiv"](program, name, ctypes.byref(value))
        return value.value


def settings(environment: Mapping[str, str]) -> list[tuple[str, str]]:
    """Returns the (name, value) of each environment variable that may change the code that Mesa generates, sorted."""
    return sorted(item for item in environment.items() if item[0].startswith(MESA) and not item[0].startswith(HARMLESS))


@cache
def processor() -> str:
    """Returns the features of the processor, whose instructions llvmpipe uses; "" where the system does not list them."""
    try:
        with Path("/proc/cpuinfo").open() as file:
            return next((line for line in file if line.startswith(("flags", "Features"))), "")
    except OSError:
        return ""
