"""Flat inputs: a program form in which the fragment stage receives its uniforms as flat inputs from the vertex stage.

llvmpipe (Mesa 22.3) reloads a uniform for every eight pixels, one SIMD lane after the other, with about 24 instructions per
number. It loads a flat input once for sixteen pixels: a picture with eight point lights takes 0.7 times as long. But every
triangle carries its flat inputs, so this form saves time only if few triangles cover many pixels. The pictures are the same to
the bit.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

from glshade.glsl.source import Declaration, Source, Stage

# The types of uniforms that become flat inputs. Each takes one of the vectors that pass between the stages; a matrix takes
# more.
TYPES = frozenset({"float", "vec2", "vec3", "vec4"})
_MAIN = "void main() {"


@lru_cache(maxsize=256)
def with_flat_inputs(source: Source, room: int) -> Source:
    """Returns the program, with uniforms of its fragment stage turned into flat inputs: the first ones, as many as fit.

    source: the program.
    room: the number of vectors that the driver passes between the stages (GL_MAX_VARYING_VECTORS).
    """
    if source.fragment is None:
        return source
    # Each element of an array takes a whole vector, and a single number may take one too.
    room -= sum(1 for _ in source.fragment.declarations("in"))
    handed: dict[int, Declaration] = {}
    for line, uniform in source.fragment.declared:
        if uniform.storage == "uniform" and uniform.type in TYPES and max(uniform.count, 1) <= room:
            room -= max(uniform.count, 1)
            handed[line] = uniform
    return handed_over(source, handed)


def handed_over(source: Source, handed: dict[int, Declaration]) -> Source:
    """Returns the program with some uniforms of its fragment stage turned into flat inputs.

    source: the program.
    handed: index of the line in the fragment stage -> declaration of the uniform.
    """
    if source.fragment is None or not handed:
        return source
    return Source(_handing_on(source.vertex, list(handed.values())), _receiving(source.fragment, handed))


def _receiving(fragment: Stage, handed: dict[int, Declaration]) -> Stage:
    """Returns the fragment stage with inputs in place of uniforms. A macro keeps each uniform's name valid in the rest of the
    text.
    """
    text: list[str] = []
    lines: list[tuple[str, int]] = []
    declared: list[tuple[int, Declaration]] = []
    known = dict(fragment.declared)
    for number, line in enumerate(fragment.text.splitlines()):
        uniform = handed.get(number)
        declaration = known.get(number) if uniform is None else _input(uniform, "in")
        if declaration is not None:
            declared.append((len(text), declaration))
        if uniform is not None:
            text += [str(_input(uniform, "in")), f"#define {uniform.name} {_input(uniform, 'in').name}"]
            lines += [fragment.lines[number]] * 2
        else:
            text.append(line)
            lines.append(fragment.lines[number])
    return Stage("".join(f"{line}\n" for line in text), tuple(lines), tuple(declared))


def _handing_on(vertex: Stage, handed: list[Declaration]) -> Stage:
    """Returns the vertex stage with the uniforms declared and copied to outputs."""
    text = vertex.text.splitlines()
    main = text.index(_MAIN)
    present = {declaration.name for declaration in vertex.declarations("uniform")}
    added = [uniform for uniform in handed if uniform.name not in present]
    added += [_input(uniform, "out") for uniform in handed]
    body = [f"    {_input(uniform, 'out').name} = {uniform.name};" for uniform in handed]
    inserted = [*map(str, added), _MAIN, *body]
    text[main : main + 1] = inserted
    lines = list(vertex.lines)
    lines[main : main + 1] = [("<flat inputs>", number) for number in range(1, len(inserted) + 1)]
    # The lines are inserted at main(), after all declarations, so the indices of the earlier ones do not change.
    declared = [*vertex.declared, *((main + number, declaration) for number, declaration in enumerate(added))]
    return Stage("".join(f"{line}\n" for line in text), tuple(lines), tuple(declared))


def _input(uniform: Declaration, storage: Literal["in", "out"]) -> Declaration:
    """Returns the flat output of the vertex stage ("out") or flat input of the fragment stage ("in") that carries a uniform."""
    return Declaration(storage, uniform.type, f"v_{uniform.name}", uniform.count, "flat")
