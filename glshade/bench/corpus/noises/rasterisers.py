"""Noise of rasterisers: the scene drawn as by a driver whose fixed functions round otherwise, within what OpenGL 3.3 allows.

OpenGL wants a grid of at least 4 sub-pixel bits for corners (SUBPIXEL_BITS), and does not say how places are rounded to it.
An edit at the end of the vertex stage moves corners as such a grid would.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.corpus.case import Case
from glshade.bench.corpus.kinds import noise
from glshade.bench.corpus.regressions.shaders import POSITION, snapped
from glshade.mesh.mesh import Mesh

Array = NDArray[Any]


def _with(case: Case, statements: str) -> Array:
    """Returns the picture with statements after the vertex stage's position."""
    return case.draw(edits=[(POSITION, rf"\g<0> {statements}")])


@noise
def snapped_to_16(case: Case) -> Array:
    """Corners are rounded to 1/16 pixel before attributes are interpolated. OpenGL asks for no finer grid."""
    return _with(case, snapped(case, 1 / 16))


@noise
def snapped_to_32(case: Case) -> Array:
    """Corners are rounded to 1/32 pixel. OpenGL asks for 1/16 at least."""
    return _with(case, snapped(case, 1 / 32))


@noise
def snapped_to_64(case: Case) -> Array:
    """Corners are rounded to 1/64 pixel. OpenGL asks for 1/16 at least."""
    return _with(case, snapped(case, 1 / 64))


@noise
def snapped_to_128(case: Case) -> Array:
    """Corners are rounded to 1/128 pixel. OpenGL asks for 1/16 at least."""
    return _with(case, snapped(case, 1 / 128))


@noise
def snapped_down(case: Case) -> Array:
    """Corners are rounded down to 1/256 pixel instead of to the nearest step. OpenGL does not say how they are rounded."""
    return _with(case, snapped(case, 1 / 256, "0.0"))


@noise
def snapped_up(case: Case) -> Array:
    """Corners are rounded up to 1/256 pixel instead of to the nearest step. OpenGL does not say how they are rounded."""
    return _with(case, snapped(case, 1 / 256, "0.999"))


@noise
def corners_uncertain(case: Case) -> Array:
    """Each corner lies up to 1/64 pixel beside its place, as on a grid of 5 bits whose origin nobody knows."""
    return _with(case, snapped(case, 1 / 1024, f"floor(32.0 * {_hash('gl_Position.xy / gl_Position.w')} - 16.0) + 0.5"))


@noise
def transform_rounded(case: Case) -> Array:
    """Positions in clip space are off by a rounding error of float32, as sums in another order or without fused operations."""
    return _with(case, f"gl_Position *= 1.0 + 1.2e-7 * vec4({_hash('gl_Position.xy')}, {_hash('gl_Position.yx')}) - 6e-8;")


@noise
def ties_redecided(case: Case) -> Array:
    """Depths are off by a rounding error of float32, so that the nearer one of two surfaces at one depth is decided again."""
    return _with(case, f"gl_Position.z *= 1.0 + 1.2e-7 * {_hash('gl_Position.xy')}.x;")


@noise
def other_corner_first(case: Case) -> Array:
    """Pixels are counted from the opposite corner. OpenGL does not say which of two triangles owns a point on their edge."""
    turned = _with(case, "gl_Position.xy = -gl_Position.xy;")
    return np.ascontiguousarray(turned[::-1, ::-1])


@noise
def in_tiles(case: Case) -> Array | None:
    """The picture is drawn in tiles of 64 pixels, each with a matrix of its own, as pictures beyond the largest size are."""
    return _tiled(case, 64)


@noise
def in_narrow_tiles(case: Case) -> Array | None:
    """The picture is drawn in tiles of 23 pixels, whose edges lie anywhere."""
    return _tiled(case, 23)


def _tiled(case: Case, side: int) -> Array | None:
    """Returns the picture drawn in tiles; None for several samples.

    With several samples, a triangle that a tile cuts is shaded apart in each piece, which changes pixels inside it.
    """
    return case.draw(tile=side) if case.scene.film.samples == 1 else None


@noise
def triangles_in_another_order(case: Case) -> Array:
    """The triangles of every mesh come in the opposite order, which decides only between surfaces at the same depth."""
    return _reordered(case, lambda mesh: {"triangles": mesh.triangles[::-1].copy()})


@noise
def triangles_begin_elsewhere(case: Case) -> Array:
    """Each triangle begins with its second corner. Sums over its corners then have another order."""
    return _reordered(case, lambda mesh: {"triangles": np.roll(mesh.triangles, -1, axis=1)})


@noise
def objects_in_another_order(case: Case) -> Array | None:
    """Objects are drawn in the opposite order, which decides only between surfaces at the same depth."""
    if any(material.alpha_mode == "blend" for material in case.scene.materials.values()):
        return None
    return case.draw(case.scene.model_copy(update={"objects": case.scene.objects[::-1]}))


@noise
def lights_in_another_order(case: Case) -> Array:
    """Lights are added in the opposite order: the sum's last digits differ, as with a compiler that reorders sums."""
    lights = case.scene.lights
    return case.draw(case.scene.model_copy(update={"lights": lights and lights[::-1]}))


def _reordered(case: Case, change: Callable[[Mesh], dict[str, Any]]) -> Array:
    """Returns the picture of the scene with changed meshes. change: returns the arrays of a mesh that change."""
    objects = []
    for item in case.scene.objects:
        # All objects of the corpus are shapes.
        assert item.shape is not None
        mesh = item.shape.mesh()
        objects.append(item.model_copy(update={"shape": None, "mesh": replace(mesh, **change(mesh))}))
    return case.draw(case.scene.model_copy(update={"objects": tuple(objects)}))


def _hash(place: str) -> str:
    """Returns GLSL for two numbers from 0 to 1 that look random, and that are equal for corners at one place.

    place: GLSL for the two numbers from which they follow.
    """
    return f"fract(sin(({place}).xy * vec2(129.898, 78.233) + ({place}).yx * 37.719) * 43758.5453)"
