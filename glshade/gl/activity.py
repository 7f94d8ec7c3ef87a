"""Activity: the uniforms, attributes and blocks of a program that the driver reports as active."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from glshade.glsl.explanation import Explanation
from glshade.glsl.interface import Interface
from glshade.glsl.source import Source


def active(source: Source, context: Any) -> Interface:
    """Returns the variables of a program that the driver reports as active, in alphabetical order.

    source: the text of the program, which is compiled here.
    context: a glshade.gl.context.Context.
    Errors: ShaderError.
    """
    from glshade.gl.program import Program

    with context.gl:
        interface = Program(context, source).interface
    # With some drivers moderngl lists the members of uniform blocks, with a dot in their names, among the uniforms.
    uniforms = {name: type for name, type in sorted(interface["uniforms"].items()) if "." not in name}
    return Interface(uniforms, dict(sorted(interface["attributes"].items())), tuple(sorted(interface["blocks"])))


def with_active(explanation: Explanation, context: Any) -> Explanation:
    """Returns the explanation with the variables that the driver reports as active, and with the driver's name.

    explanation: the explanation without a driver.
    context: a glshade.gl.context.Context.
    Errors: ShaderError.
    """
    programs = tuple(replace(program, active=active(program.source, context)) for program in explanation.programs)
    return replace(explanation, programs=programs, driver=f"{context.renderer}; {context.version}")
