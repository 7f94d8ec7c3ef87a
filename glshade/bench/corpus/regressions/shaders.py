"""Faults of shader programs: edits of their text, as a slip of a programmer or of a compiler would make.

Each function takes a case and a strength and returns pairs of a regular expression and its replacement.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from glshade.bench.corpus.case import Case
from glshade.bench.corpus.kinds import regression

Array = NDArray[Any]
Edits: TypeAlias = "tuple[tuple[str, str], ...]"
# Places in the programs: the vertex's position, the shading frame, a light, the model's cosine of
# incidence, the output, and a texture.
POSITION = r"gl_Position = clip_position\(\);"
FRAME = r"Frame f = frame\(side\);"
LIT = r"= illuminate\(light, p, l\);"
COSINE = r"float NoL = dot\(f\.n, l\);"
OUTPUT = r"o_colour = encode\("
TEXTURE = r"texture\((\w+), (\w+)\)"


def shader_fault(*strengths: Any) -> Callable[[Callable[[Case, Any], Edits]], Callable[[Case, Any], Array | None]]:
    """Returns a decorator that adds a function (case, strength) -> edits to the regressions.

    The fault does not apply to a scene whose picture it leaves as it is, because no program has the text.
    """

    def add(function: Callable[[Case, Any], Edits]) -> Callable[[Case, Any], Array | None]:
        @wraps(function)
        def make(case: Case, strength: Any) -> Array | None:
            pixels = case.draw(edits=function(case, strength))
            return None if np.array_equal(pixels, case.baseline) else pixels

        return regression(*strengths)(make)

    return add


def _after(place: str, statements: str) -> Edits:
    """Returns the edit that adds statements after a place."""
    return ((place, rf"\g<0> {statements}"),)


@shader_fault(1.5, 1.05, 1.02)
def exponent_wrong(case: Case, factor: float) -> Edits:
    """Exponents are too large."""
    return ((r"m\.(exponent|pu|pv) = ([^;]+);", rf"m.\1 = {factor} * (\2);"),)


@shader_fault(10.0, 3.0, 1.0)
def normals_turned(case: Case, degrees: float) -> Edits:
    """Normals are turned about one axis."""
    tangent = float(np.tan(np.radians(degrees)))
    return _after(FRAME, f"f.n = normalize(f.n + {tangent:.6f} * cross(f.n, vec3(0.36, 0.48, 0.8)));")


@shader_fault(1.0, 0.3, 0.1)
def normals_exchanged(case: Case, share: float) -> Edits:
    """The coordinates x and y of normals are exchanged, or mixed."""
    return _after(FRAME, f"f.n = normalize(mix(f.n, f.n.yxz, {share:.3f}));")


@shader_fault(1.3, 1.05, 1.02)
def normals_not_unit(case: Case, factor: float) -> Edits:
    """Normals are too long."""
    return _after(FRAME, f"f.n *= {factor};")


@shader_fault(1.0, 0.7, 0.4)
def normals_not_normalised(case: Case, share: float) -> Edits:
    """Interpolated normals keep the length that interpolation gave them, or a share of it."""
    return (
        (r"return Frame\(side \* unit\((\w+)\)", rf"return Frame(side * mix(unit(\1), \1, {share:.3f})"),
        (r"vec3 n = unit\((\w+)\);", rf"vec3 n = mix(unit(\1), \1, {share:.3f});"),
    )


@shader_fault(1.0, 0.3, 0.1)
def light_leaks(case: Case, share: float) -> Edits:
    """Light from behind a surface shines through it, in full or in part."""
    return _after(COSINE, f"NoL = NoL < 0.0 ? -{share:.3f} * NoL : NoL;")


@shader_fault(0.5, 0.1, 0.03)
def light_wraps(case: Case, share: float) -> Edits:
    """Light reaches round the edge of its own shadow."""
    return _after(COSINE, f"NoL = (NoL + {share:.3f}) / {1 + share:.3f};")


@shader_fault(1.0, 0.3, 0.1)
def directions_exchanged(case: Case, share: float) -> Edits:
    """The directions to the light and to the viewer are exchanged, or mixed."""
    mixed = "normalize(mix({}, {}, " + f"{share:.3f}))"
    return ((r"brdf_cos\(m, f, l, v\)", f"brdf_cos(m, f, {mixed.format('l', 'v')}, {mixed.format('v', 'l')})"),)


@shader_fault(1.3, 1.05, 1.02)
def light_scaled(case: Case, factor: float) -> Edits:
    """All light with a direction is too strong."""
    return ((LIT, f"= {factor} * illuminate(light, p, l);"),)


@shader_fault(3.0, 3.1, 3.125)
def pi_wrong(case: Case, pi: float) -> Edits:
    """The number pi is wrong."""
    return ((r"const float INV_PI = [0-9.]+;", f"const float INV_PI = {1 / pi:.9f};"),)


@shader_fault(4.0, 2.0, 1.0)
def texture_shifted(case: Case, texels: float) -> Edits:
    """Textures are read some texels beside the right place."""
    return ((TEXTURE, rf"texture(\1, \2 + {texels} / vec2(textureSize(\1, 0)))"),)


@shader_fault(3.0, 1.0, 0.5)
def level_of_detail_wrong(case: Case, levels: float) -> Edits:
    """Textures are read from too coarse mipmaps."""
    return ((TEXTURE, rf"texture(\1, \2, {levels})"),)


@shader_fault(8, 32, 128)
def triangles_lost(case: Case, every: int) -> Edits:
    """Every eighth triangle, or fewer of them, is missing."""
    return ((OUTPUT, rf"if (gl_PrimitiveID % {every} == {every // 2}) discard; \g<0>"),)


@shader_fault(16, 64, 256)
def depth_coarse(case: Case, levels: int) -> Edits:
    """The depth buffer has only some levels, so that hidden surfaces show."""
    return ((OUTPUT, rf"gl_FragDepth = floor({levels}.0 * gl_FragCoord.z) / {levels}.0; \g<0>"),)


@shader_fault(1.0, 0.6, 0.4)
def depth_reversed(case: Case, share: float) -> Edits:
    """Far surfaces hide near ones, in the whole picture or in its left part."""
    edge = share * case.scene.film.size[0]
    return ((OUTPUT, rf"gl_FragDepth = gl_FragCoord.x < {edge:.1f} ? 1.0 - gl_FragCoord.z : gl_FragCoord.z; \g<0>"),)


@shader_fault(1.0, 0.5, 0.25)
def corners_coarse(case: Case, step: float) -> Edits:
    """Corners of triangles are rounded to whole pixels, or to a half or a quarter of a pixel."""
    return _after(POSITION, snapped(case, step))


@shader_fault(1.1, 1.03, 1.01)
def camera_wider(case: Case, factor: float) -> Edits:
    """The camera's field of view is too wide."""
    return _after(POSITION, f"gl_Position.xy /= {factor};")


def snapped(case: Case, step: float, rounding: str = "0.5") -> str:
    """Returns GLSL that moves a corner to a multiple of `step` [pixels] in the picture.

    rounding: GLSL that is added before the place is rounded down: 0.5 rounds to the nearest multiple.
    """
    width, height = case.scene.film.size
    # Clip space is 2 wide, and the picture `width` pixels.
    steps = f"vec2({0.5 * width / step}, {0.5 * height / step})"
    return (
        f"if (gl_Position.w > 0.0) gl_Position.xy = (floor(gl_Position.xy / gl_Position.w * {steps} + {rounding})) / {steps} "
        "* gl_Position.w;"
    )
