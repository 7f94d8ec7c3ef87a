"""Flat inputs: what is uniform in the fragment stage, handed on by the vertex stage instead. No GL.

llvmpipe (Mesa 22.3) gathers a uniform anew for every eight pixels, lane by lane, in two dozen instructions a number; what a
triangle hands on unchanged it loads once for sixteen. A picture with eight point lights takes 0.7 times as long. But every
triangle carries them, so this is for few triangles on many pixels. The numbers are the same to the bit, and so is the picture.
"""

from __future__ import annotations

import re
from functools import lru_cache

from glshade.glsl.generator import Source, Stage

# As source.py declares the numbers of lights and materials.
_UNIFORM = re.compile(r"uniform (?P<type>float|vec[234]) u_(?P<name>\w+?)(?P<array>\[(?P<count>\d+)\])?;")
_INPUT = re.compile(r"(flat |centroid )?in \w+ \w+;")
_MAIN = "void main() {"


@lru_cache(maxsize=1024)
def with_flat_inputs(source: Source, room: int) -> Source:
    """The same program with its fragment stage's uniforms as flat inputs, from the first as far as the room goes.

    room: how many vectors the driver passes between the stages (GL_MAX_VARYING_VECTORS).
    """
    fragment = source.fragment
    if fragment is None:
        return source
    lines = fragment.text.splitlines()
    # Each element of an array takes a vector's place, and so may a single number.
    room -= sum(bool(_INPUT.fullmatch(line)) for line in lines)
    handed: list[re.Match[str]] = []
    for index, line in enumerate(lines):
        found = _UNIFORM.fullmatch(line)
        if found and int(found["count"] or 1) <= room:
            room -= int(found["count"] or 1)
            lines[index] = f"flat in {found['type']} u_{found['name']}{found['array'] or ''};"
            handed.append(found)
    if not handed:
        return source
    text = "".join(f"{line}\n" for line in lines)
    for found in handed:
        text = re.sub(rf"\bu_{found['name']}\b", f"v_u_{found['name']}", text)
    return Source(_handing_on(source.vertex, handed), Stage(text, fragment.lines))


def _handing_on(vertex: Stage, handed: list[re.Match[str]]) -> Stage:
    """The vertex stage with the uniforms, and with outputs that it sets to them."""
    lines, places = vertex.text.splitlines(), list(vertex.lines)
    main = lines.index(_MAIN)
    body = [f"    v_u_{one['name']} = u_{one['name']};" for one in handed]
    head = [one[0] for one in handed if one[0] not in lines]
    head += [f"flat out {one['type']} v_u_{one['name']}{one['array'] or ''};" for one in handed]
    lines[main : main + 1] = [*head, _MAIN, *body]
    places[main : main + 1] = [("<flat inputs>", i + 1) for i in range(len(head) + 1 + len(body))]
    return Stage("".join(f"{line}\n" for line in lines), tuple(places))
