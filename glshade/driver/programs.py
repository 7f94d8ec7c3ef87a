"""Programs: loads the shader files of the measurements."""

from __future__ import annotations

from collections.abc import Mapping

from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.glsl.shaders import expand
from glshade.glsl.source import Source, Stage

# The vertex stage of a triangle that covers the screen.
COVER = "pass/picture.vert"


def load_program(
    context: Context,
    vertex: str,
    fragment: str | None = None,
    generated: Mapping[str, str] | None = None,
    varyings: tuple[str, ...] = (),
) -> Program:
    """Returns the program whose stages are one or two files under shaders/.

    vertex: the file of the vertex stage, such as "pass/picture.vert".
    fragment: the file of the fragment stage; None for a program whose vertex outputs are captured instead.
    generated: name of an include in angle brackets -> the text that replaces it.
    varyings: the names of the vertex stage's outputs that are captured.
    Errors: ShaderError.
    """

    def stage(name: str) -> Stage:
        return expand(name, generated or {})

    return Program(context, Source(stage(vertex), stage(fragment) if fragment else None), varyings)
