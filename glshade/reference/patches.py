"""Patches: the parts of triangles in which a driver may shade a fragment, and the range of the light there.

With several samples per pixel, a fragment that covers only some of them may be shaded anywhere in the pixel's square and its
triangle. The light is evaluated at some places of this patch. Between them, it may be more extreme than at any of them by half
of the second difference of three places in a line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.surface import Surface, at_vertices, evaluate_surface
from glshade.reference.interpolate import blend, weights
from glshade.reference.raster import Fragments
from glshade.reference.shade import Sampling, places

Array = NDArray[Any]
Indices = NDArray[Any]
Line = tuple[int, int, int]

# The weights of a triangle's corners at seven of its places: the corners, the middle, and halfway between it and each corner.
TRIANGLE = np.array(
    [
        (1, 0, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1 / 3, 1 / 3, 1 / 3),
        (2 / 3, 1 / 6, 1 / 6),
        (1 / 6, 2 / 3, 1 / 6),
        (1 / 6, 1 / 6, 2 / 3),
    ]
)
# Three places in a line each: (end, middle, end).
TRIANGLE_LINES: tuple[Line, ...] = ((0, 4, 3), (1, 5, 3), (2, 6, 3))
# The same for a square grid of 3 x 3 places, row by row.
GRID_LINES: tuple[Line, ...] = ((0, 1, 2), (3, 4, 5), (6, 7, 8), (0, 3, 6), (1, 4, 7), (2, 5, 8), (0, 4, 8), (2, 4, 6))


@dataclass(frozen=True, eq=False)
class Range:
    """The range of the light (N, 3) over the patches of N fragments.

    low: the least light.
    high: the largest light.
    rounding: the largest difference between the light computed in float32 and in float64.
    """

    low: Array
    high: Array
    rounding: Array


def light_range(draw: Draw, points: Iterable[Surface], lines: tuple[Line, ...], narrow: Callable[[Surface], Surface]) -> Range:
    """Returns the range of the light.

    points: the surface at each of the places.
    lines: the places that lie in a line.
    narrow: rounds a surface to float32; the first three places are shaded once more in float32.
    """
    light, rounding = [], np.zeros((0, 3))
    for number, point in enumerate(points):
        light.append(evaluate_surface(draw, point))
        if number < 3:
            error = np.abs(evaluate_surface(draw, narrow(point)) - light[-1])
            rounding = np.maximum(rounding, error) if len(rounding) else error
    bends = [np.abs(light[first] - 2 * light[middle] + light[last]) for first, middle, last in lines]
    margin = np.maximum.reduce(bends) / 2
    return Range(np.minimum.reduce(light) - margin, np.maximum.reduce(light) + margin, rounding)


def on_triangles(draw: Draw, fragments: Fragments, surface: Surface) -> Iterator[Surface]:
    """Yields the surface at the places TRIANGLE of the fragments' triangles. surface: as for `on_grid`."""
    weight = (np.broadcast_to(row, (len(fragments), 3)) for row in TRIANGLE)
    return _at(draw, fragments, surface, weight)


def on_grid(
    draw: Draw, fragments: Fragments, surface: Surface, size: tuple[int, int], extent: float, count: int, inside: bool
) -> Iterator[Surface]:
    """Yields the surface on a grid of count x count places over each fragment's pixel, row by row.

    surface: the attributes at the centres. Texture coordinates are interpolated at the centre in any case.
    size: width and height of the picture [pixels].
    extent: half the side of the square [pixels].
    inside: whether a place outside of the triangle is replaced by one on the triangle's border.
    """
    steps = np.linspace(-extent, extent, count)

    def weight() -> Iterator[Array]:
        for down in steps:
            for right in steps:
                x, y = places(fragments, size, Sampling((float(right), float(down))))
                values = weights(draw, fragments.triangle, x, y, size, derivatives=False).values
                clamped = np.maximum(values, 0)
                yield clamped / clamped.sum(axis=1, keepdims=True) if inside else values

    return _at(draw, fragments, surface, weight())


def _at(draw: Draw, fragments: Fragments, surface: Surface, weight: Iterable[Array]) -> Iterator[Surface]:
    """Yields the surface with attributes of other weights. weight: the weights (N, 3) of the corners at each place."""
    vertices, place = np.unique(draw.triangles[fragments.triangle], return_inverse=True)
    corner = at_vertices(draw, vertices, np.float64)
    names = [name for name in ("position", "normal", "tangent", "colour") if getattr(surface, name) is not None]
    corners = {name: getattr(corner, name)[place.reshape(-1, 3)] for name in names}
    for by in weight:
        moved: dict[str, Any] = {name: blend(by, values) for name, values in corners.items()}
        yield replace(surface, **moved)
