"""Instrument: changes a text so that the GPU returns the value of a variable in place of the result."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from glshade.glsl.source import Source, Stage
from glshade.spirv.trace import Step

# How a variable of each type is put into the three numbers that the GPU returns.
AS_VEC3 = {
    "float": "vec3({0}, 0.0, 0.0)",
    "int": "vec3(float({0}), 0.0, 0.0)",
    "bool": "vec3(float({0}), 0.0, 0.0)",
    "vec2": "vec3({0}, 0.0)",
    "vec3": "vec3({0})",
}
_DECLARATION = "vec3 traced_value = vec3(0.0); "
_FUNCTION = "vec3 traced(vec3 l, vec3 v) { value(l, v); return traced_value; } "
_RETURN = re.compile(r"return\b(?P<value>.*);\s*$")
_COMMENT = re.compile(r"//.*|/\*.*?\*/")


def instrumented(source: Source, steps: Sequence[Step]) -> Source:
    """Returns a program that returns the values of steps in place of its result: the n-th vertex, or pixel, the n-th step.

    source: a program that evaluates `vec3 value(vec3 l, vec3 v)` (shaders/pass/evaluate.vert and .frag).
    steps: the steps, for all of which `can_be_kept` is True.
    """
    if source.fragment is None:
        return Source(_changed(source.vertex, steps, "gl_VertexID"), None)
    return Source(source.vertex, _changed(source.fragment, steps, "int(gl_FragCoord.x)"))


def _changed(stage: Stage, steps: Sequence[Step], lane: str) -> Stage:
    """Returns the stage with the steps' values kept. No line is added, so that all lines keep their places.

    lane: the number of the vertex or pixel, as a GLSL expression.
    """
    lines = stage.text.splitlines()
    plain = _plain(stage)
    for number, step in enumerate(steps):
        at = _end_of_statement(stage, plain, step)
        if at is not None:
            lines[at] = _keeping(lines[at], plain[at], step, f"{lane} == {number}")
    main = next(index for index, line in enumerate(plain) if line.startswith("void main()"))
    lines[main:] = [re.sub(r"\bvalue\(", "traced(", line) for line in lines[main:]]
    lines[main] = _FUNCTION + lines[main]
    first = next(index for index, line in enumerate(plain) if not line.startswith("#"))
    lines[first] = _DECLARATION + lines[first]
    return replace(stage, text="\n".join(lines) + "\n")


def can_be_kept(step: Step, stage: Stage) -> bool:
    """Returns whether the GPU can return the value of a step of a stage: it has at most three numbers and no index that is
    unknown, and its statement ends at the end of a line.
    """
    small = step.type in AS_VEC3 and "[i]" not in step.name and step.function != "main"
    return small and _end_of_statement(stage, _plain(stage), step) is not None


def _plain(stage: Stage) -> list[str]:
    """Returns the lines of a stage without comments."""
    return [_COMMENT.sub("", line).rstrip() for line in stage.text.splitlines()]


def _end_of_statement(stage: Stage, plain: list[str], step: Step) -> int | None:
    """Returns the index of the line at which the statement of a step ends; None where it is not known."""
    places = [index for index, (file, number) in enumerate(stage.lines) if f"{file}:{number}" == step.place]
    if not places or plain[places[0]].lstrip().startswith(("for", "while", "if", "else")):
        return None
    end = next((index for index in range(places[0], len(plain)) if plain[index].endswith((";", "{", "}"))), None)
    is_whole = end is not None and plain[end].endswith(";") and (step.name != "return" or end == places[0])
    return end if is_whole else None


def _keeping(line: str, plain: str, step: Step, wanted: str) -> str:
    """Returns a line with code that keeps the value of a step where the condition `wanted` holds."""
    if step.name != "return":
        # A comment at the end of the line would hide code after it, so it is dropped.
        return f"{_COMMENT.sub('', line).rstrip()} if ({wanted}) traced_value = {AS_VEC3[step.type].format(step.name)};"
    match = _RETURN.search(plain)
    if match is None:
        return line
    kept = f"{step.type} traced_return = {match['value']}; if ({wanted}) traced_value = "
    return f"{plain[: match.start()]}{{ {kept}{AS_VEC3[step.type].format('traced_return')}; return traced_return; }}"
