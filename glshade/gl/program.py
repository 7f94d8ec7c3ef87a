"""Program: a Source compiled and linked by the driver, whose messages are rewritten to name file, line and column."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.errors import ShaderError
from glshade.gl.context import Context
from glshade.gl.driver_log import problems_of_log
from glshade.gl.orphans import delete_orphans
from glshade.glsl.source import Source

# The types of uniforms and attributes by their values in Khronos' registry (gl.xml).
TYPES = {
    0x1404: "int",
    0x1405: "uint",
    0x1406: "float",
    0x8B56: "bool",
    0x8B50: "vec2",
    0x8B51: "vec3",
    0x8B52: "vec4",
    0x8B53: "ivec2",
    0x8B54: "ivec3",
    0x8B55: "ivec4",
    0x8DC6: "uvec2",
    0x8DC7: "uvec3",
    0x8DC8: "uvec4",
    0x8B57: "bvec2",
    0x8B58: "bvec3",
    0x8B59: "bvec4",
    0x8B5A: "mat2",
    0x8B5B: "mat3",
    0x8B5C: "mat4",
    0x8B65: "mat2x3",
    0x8B66: "mat2x4",
    0x8B67: "mat3x2",
    0x8B68: "mat3x4",
    0x8B69: "mat4x2",
    0x8B6A: "mat4x3",
    0x8B5E: "sampler2D",
    0x8B5F: "sampler3D",
    0x8B60: "samplerCube",
    0x8B62: "sampler2DShadow",
    0x8DC1: "sampler2DArray",
}


class Program:
    """A linked program.

    gl: moderngl's program.
    members: name -> moderngl's object, of all active variables.
    attributes: the names of the active vertex attributes.
    uniforms: the names of the active uniforms.
    blocks: the names of the active uniform blocks.
    seconds: the time that it took to compile and link it [s].
    """

    def __init__(self, context: Context, source: Source, varyings: tuple[str, ...] = ()) -> None:
        """Compiles and links a program, or loads it from the disk cache.

        context: the context, which must be current.
        source: the text of the program.
        varyings: the outputs of the vertex stage that transform feedback captures.
        Errors: ShaderError with the driver's messages.
        """
        start = perf_counter()
        try:
            fragment = source.fragment.text if source.fragment else None
            if context.linker and not varyings:
                self.gl = context.linker.program(context.gl, source.vertex.text, fragment)
            else:
                self.gl = context.gl.program(source.vertex.text, fragment, varyings=varyings)
        except moderngl.Error as error:
            delete_orphans(context)
            problems = problems_of_log(str(error), source)
            raise ShaderError("\n".join(map(str, problems)), problems) from None
        self.seconds = perf_counter() - start
        self.members: dict[str, Any] = {name: self.gl[name] for name in self.gl}
        self.attributes = tuple(name for name, member in self.members.items() if isinstance(member, moderngl.Attribute))
        self.uniforms = tuple(name for name, member in self.members.items() if isinstance(member, moderngl.Uniform))
        self.blocks = tuple(name for name, member in self.members.items() if isinstance(member, moderngl.UniformBlock))

    @property
    def interface(self) -> dict[str, dict[str, Any]]:
        """The active variables as JSON types.

        "attributes" and "uniforms": name -> GLSL type, for example `vec3` or `float[4]`; an array of one counts as no array.
        "blocks": name -> size [bytes].
        """
        return {
            "attributes": {name: _type(self.members[name]) for name in self.attributes},
            "uniforms": {name: _type(self.members[name]) for name in self.uniforms},
            "blocks": {name: self.members[name].size for name in self.blocks},
        }

    def write(self, name: str, value: NDArray[np.float32]) -> None:
        """Sets a float uniform or an array of them. A name that is not an active uniform is ignored.

        name: the uniform. One whose name contains `_from_` is a matrix, which GL stores by columns, so it is transposed.
        value: its value, matrices by rows.
        """
        member = self.members.get(name)
        if member is not None:
            member.write((value.T if "_from_" in name else value).tobytes())

    def set_integer(self, name: str, value: int) -> None:
        """Sets an int uniform, or the texture unit of a sampler. A name that is not an active uniform is ignored."""
        member = self.members.get(name)
        if member is not None:
            member.value = value


def _type(member: Any) -> str:
    """Returns the GLSL type of a uniform or an attribute; its number in hexadecimal digits if TYPES does not have it."""
    name = TYPES.get(member.gl_type, f"{member.gl_type:#06x}")
    return f"{name}[{member.array_length}]" if member.array_length > 1 else name
