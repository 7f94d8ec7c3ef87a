"""Linker: makes moderngl's programs from binaries on disk where there are some (glGetProgramBinary, glProgramBinary).

moderngl compiles, links and reflects a program in one call, and knows no binaries. But it asks its context for every GL
function, so the Linker stands in as the context and hands out its own for three of them: while it has a binary at hand,
nothing is compiled, and to link is to load. docs/decisions/0008-program-binaries.md tells what that is worth.
"""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable
from typing import Any

import moderngl

from glshade.gl.binaries import Binaries, Binary
from glshade.version import __version__

# Khronos' registry values (gl.xml).
GL_VENDOR, GL_RENDERER, GL_VERSION = 0x1F00, 0x1F01, 0x1F02
GL_NUM_PROGRAM_BINARY_FORMATS, GL_PROGRAM_BINARY_FORMATS = 0x87FE, 0x87FF
GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_PROGRAM_BINARY_LENGTH = 0x8257, 0x8741
GL_COMPILE_STATUS, GL_LINK_STATUS = 0x8B81, 0x8B82

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
    """A context for moderngl around another one, which has to be current when the Linker is made.

    offers_binaries: whether the driver does; where not, the Linker is of no use.
    """

    def __init__(self, window: Any, binaries: Binaries, backend: str) -> None:
        """window: what moderngl would have as its `context=`, glcontext's or OSMesa's."""
        self._window, self._binaries = window, binaries
        # While a program is made: what is loaded in place of compiling, whether the driver took it, and what went wrong.
        self._at_hand: Binary | None = None
        self._taken = False
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
            # The backend too: one driver behind two doors is two libraries, which need not take each other's binaries.
            self._driver = repr((__version__, backend, names, formats))
            for name, own in (
                ("glCompileShader", self._compile),
                ("glGetShaderiv", self._ask_shader),
                ("glLinkProgram", self._link),
            ):
                self._own[name] = _SIGNATURES[name](self._kept_from_ctypes(own))

    def load_opengl_function(self, name: str) -> int:
        """The address of a GL function, 0 where there is none."""
        own = self._own.get(name)
        return self._window.load_opengl_function(name) if own is None else ctypes.cast(own, _pointer).value or 0

    def __enter__(self) -> Any:
        return self._window.__enter__()

    def __exit__(self, *unused: Any) -> Any:
        return self._window.__exit__(*unused)

    def release(self) -> None:
        """Destroys the context."""
        self._window.release()

    def program(self, gl: moderngl.Context, vertex: str, fragment: str | None) -> moderngl.Program:
        """The program of these texts, linked. gl: made with this Linker. Errors: moderngl.Error, the driver's words."""
        key = self.key(vertex, fragment)
        stored = self._binaries.recall(key)
        if stored:
            try:
                program = self._make(gl, vertex, fragment, stored)
            except moderngl.Error:
                # The driver took neither its binary nor, uncompiled until then, the texts; what is wrong with them it says now.
                stored = None
        if not stored:
            program = self._make(gl, vertex, fragment, None)
        if not self._taken and (binary := self._binary(program.glo)):
            self._binaries.keep(key, binary)
        return program

    def key(self, vertex: str, fragment: str | None) -> str:
        """What an entry is found by: a digest of the texts, the driver, its formats, and glshade's version."""
        return hashlib.sha256("\0".join((self._driver, vertex, fragment or "")).encode()).hexdigest()

    def _make(self, gl: moderngl.Context, vertex: str, fragment: str | None, at_hand: Binary | None) -> moderngl.Program:
        self._at_hand, self._taken, self._raised = at_hand, False, None
        try:
            return gl.program(vertex, fragment)
        finally:
            self._at_hand = None
            if self._raised:
                raise self._raised

    def _kept_from_ctypes(self, function: Callable[..., None]) -> Callable[..., None]:
        """The function, its exceptions put aside: ctypes prints them and goes on, and a Ctrl-C would be lost."""

        def called(*arguments: Any) -> None:
            try:
                function(*arguments)
            except BaseException as error:
                self._raised = error

        return called

    def _compile(self, shader: int) -> None:
        if not self._at_hand:
            self._gl["glCompileShader"](shader)

    def _ask_shader(self, shader: int, name: int, value: Any) -> None:
        if self._at_hand and name == GL_COMPILE_STATUS:
            value[0] = 1
        else:
            self._gl["glGetShaderiv"](shader, name, value)

    def _link(self, program: int) -> None:
        if self._at_hand:
            kind, data = self._at_hand
            self._gl["glProgramBinary"](program, kind, data, len(data))
            self._taken = bool(self._ask_program(program, GL_LINK_STATUS))
            if self._taken:
                return
            # Refused, which may be an error too: nobody else is to find it.
            self._gl["glGetError"]()
            shaders, count = (_uint * 8)(), _int()
            self._gl["glGetAttachedShaders"](program, len(shaders), ctypes.byref(count), shaders)
            for shader in shaders[: count.value]:
                self._gl["glCompileShader"](shader)
        self._gl["glProgramParameteri"](program, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, 1)
        self._gl["glLinkProgram"](program)

    def _binary(self, program: int) -> Binary | None:
        data = ctypes.create_string_buffer(self._ask_program(program, GL_PROGRAM_BINARY_LENGTH))
        kind, length = _uint(), _int()
        self._gl["glGetProgramBinary"](program, len(data), ctypes.byref(length), ctypes.byref(kind), data)
        return (kind.value, data.raw[: length.value]) if length.value > 0 else None

    def _formats(self) -> list[int]:
        count = _int()
        self._gl["glGetIntegerv"](GL_NUM_PROGRAM_BINARY_FORMATS, ctypes.byref(count))
        formats = (_int * max(count.value, 0))()
        if count.value > 0:
            self._gl["glGetIntegerv"](GL_PROGRAM_BINARY_FORMATS, formats)
        return sorted(formats)

    def _ask_program(self, program: int, name: int) -> int:
        value = _int()
        self._gl["glGetProgramiv"](program, name, ctypes.byref(value))
        return value.value
