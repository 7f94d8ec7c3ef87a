"""Instancing: a program form that draws many instances at once. Uniforms that differ among them become vertex attributes.

Such an attribute has one value for each instance. The fragment stage receives it from the vertex stage as a flat input. The
arithmetic of the program stays the same, and so do the pictures, to the bit.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from glshade.glsl.flat_inputs import handed_over
from glshade.glsl.source import Source, Stage


@lru_cache(maxsize=256)
def with_instances(source: Source, names: tuple[str, ...]) -> Source:
    """Returns the program with some of its uniforms as attributes of the instances. They keep their names and types.

    source: the program.
    names: the names of the uniforms. Those that the program does not declare are ignored.
    """
    if source.fragment is not None:
        read = {
            line: uniform
            for line, uniform in source.fragment.declared
            if uniform.storage == "uniform" and uniform.name in names
        }
        source = handed_over(source, read)
    return replace(source, vertex=_with_inputs(source.vertex, names))


def _with_inputs(vertex: Stage, names: tuple[str, ...]) -> Stage:
    """Returns the vertex stage with inputs in place of these uniforms."""
    text = vertex.text.splitlines()
    declared = []
    for line, declaration in vertex.declared:
        if declaration.storage == "uniform" and declaration.name in names:
            declaration = replace(declaration, storage="in")
            text[line] = str(declaration)
        declared.append((line, declaration))
    return Stage("".join(f"{line}\n" for line in text), vertex.lines, tuple(declared))
