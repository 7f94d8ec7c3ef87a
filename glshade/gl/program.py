"""Program: a Source compiled by the driver. Its messages are rewritten to the file, line and column they speak of."""

from __future__ import annotations

import re
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.errors import ShaderError
from glshade.gl.context import Context
from glshade.source import Source, Stage

# Mesa `0:12(5): error: text`, NVIDIA `0(12) : error C1008: text`, Apple, ANGLE and Intel `ERROR: 0:12: text`.
_MESA = re.compile(r"^\s*\d+:(?P<line>\d+)\((?P<column>\d+)\):\s*(?P<message>.*)$")
_NVIDIA = re.compile(r"^\s*\d+\((?P<line>\d+)\)\s*:\s*(?P<message>.*)$")
_OTHERS = re.compile(r"^\s*(?P<kind>ERROR|WARNING):\s*\d+:(?P<line>\d+):\s*(?P<message>.*)$")
_HEADING = re.compile(r"^(vertex|fragment|geometry|compute)[ _]shader|^=+$|^GLSL Compiler failed|^GLSL Linker failed", re.I)


def rewrite(log: str, stage: Stage) -> list[str]:
    """The driver's messages, each as `file:line:column: message` (no column where the driver gives none)."""
    result = []
    for raw in log.splitlines():
        for pattern in (_MESA, _NVIDIA, _OTHERS):
            match = pattern.match(raw)
            if match:
                parts = match.groupdict()
                column = f":{parts['column']}" if "column" in parts else ""
                result.append(f"{stage.place(int(parts['line']))}{column}: {parts['message']}")
                break
        else:
            if raw.strip() and not _HEADING.match(raw.strip()):
                result.append(raw.strip())
    return result


class Program:
    """A linked program. uniforms: the active ones by GLSL name; writing an unknown one is an error of ours."""

    def __init__(self, context: Context, source: Source, varyings: tuple[str, ...] = ()) -> None:
        try:
            fragment = source.fragment.text if source.fragment else None
            self.gl = context.gl.program(source.vertex.text, fragment, varyings=varyings)
        except moderngl.Error as error:
            raise ShaderError("\n".join(_explain(str(error), source))) from None
        self.members: dict[str, Any] = {name: self.gl[name] for name in self.gl}
        self.attributes = tuple(name for name, member in self.members.items() if isinstance(member, moderngl.Attribute))
        self.uniforms = tuple(name for name, member in self.members.items() if isinstance(member, moderngl.Uniform))

    def write(self, name: str, value: NDArray[np.float32]) -> None:
        """Sets a float uniform or an array of them; a matrix (`u_to_from_from`) is turned to columns, as GL has them.

        A uniform that the driver found unused is passed over.
        """
        member = self.members.get(name)
        if member is not None:
            member.write((value.T if "_from_" in name else value).tobytes())

    def set_integer(self, name: str, value: int) -> None:
        """Sets an int or a sampler's unit."""
        member = self.members.get(name)
        if member is not None:
            member.value = value


def _explain(message: str, source: Source) -> list[str]:
    """moderngl names the stage in its heading: `vertex_shader` or `fragment_shader`."""
    in_fragment = source.fragment and re.search(r"fragment[_ ]shader", message)
    lines = rewrite(message, source.fragment if source.fragment and in_fragment else source.vertex)
    return lines or [message]
