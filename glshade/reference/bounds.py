"""Bounds: the limits between which a float32 driver may show a fragment. docs/tolerance.md derives the rule and its constants.

Float32 arithmetic in vertices and plane equations leaves an error in each of a fragment's attributes. The model is evaluated
at the exact attributes, at attributes that are perturbed by these errors, and once more in float32, to measure the rounding of
its own arithmetic. The rule is the same for every model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import islice, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.sampler import Sampler
from glshade.radiance.surface import (
    Surface,
    added_light,
    alpha_of,
    at_vertices,
    by_columns,
    evaluate_surface,
    joined,
    light_at,
    mapped,
    material_of,
    part_of,
    repeated,
    toward_viewer,
)
from glshade.reference.division import by_structure
from glshade.reference.freedom import LLVMPIPE, Freedom
from glshade.reference.inputs import Inputs
from glshade.reference.interpolate import blend, weights
from glshade.reference.patches import GRID_LINES, TRIANGLE_LINES, Range, light_range, on_grid, on_triangles
from glshade.reference.planes import Planes
from glshade.reference.raster import Fragments, U
from glshade.reference.shade import AT_CENTRE, places, surface_at
from glshade.reference.slivers import slimness
from glshade.textures.volume import Volume

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# The error of each component of a unit vector that the vertex stage computes. A dot product of three terms contributes about
# 1.5 roundings, inversesqrt 1 and a product 0.5.
UNIT = 4 * U
# The factor on the measured rounding error of the shading. The reference in float32 rounds differently from the driver, and
# its error may be smaller by chance.
AGAIN = 4.0
# The least rounding error of the shading, relative to the value or to the picture's brightest value (counted as at most 1),
# whichever is larger. It is 16 ulps of float32; an ulp of a number is at most 2 U times the number.
STEPS = 16 * 2 * U
# A float32 sum of n numbers, added in any order, has an error of at most n U times the sum of their absolute values (Higham
# 2002, section 4.2). STEPS covers the sum over this many lights; for more lights the allowed error grows with their number.
SUMMED = STEPS / U
# The smallest normal float32 number. Drivers flush smaller numbers to 0.
TINY = 2.0**-126
# A flushed number may be multiplied by the light that arrives and by factors of the model up to this. The largest is the peak
# of a narrow lobe, 1 / alpha^2 = 1e8 for the narrowest, and the others stay below 100.
MAGNIFIED = 1e10
# The level of detail is sampled at this many values, from its least possible to its largest possible value.
LEVELS = 9
# A texture coordinate is sampled at this many values, from one end of its error to the other.
SHIFTS = 5
# The errors of a vector's three components make a box of possible vectors. If the light over this box deviates from a linear
# function by more than this share of its range, it is sampled at LEVELS points along each diagonal of the box, not only at the
# corners.
BENT = 0.1
# A light counts as close to a box of positions if its distance is below this multiple of the box's largest error: the light
# then changes over the box by more than a linear function tells.
CLOSE = 16.0
# If a fragment may be shaded anywhere in its pixel and the light is curved there, it is shaded at this many places in each
# direction.
GRID = 5
# A triangle that is not wider and not higher than this is shaded as a whole wherever a driver may shade it in a pixel [pixels].
SMALL = 0.75
# A triangle with at least this height has attributes that do not change by more than from corner to corner in a pixel, so that
# they may be extrapolated over the pixels at its border [pixels].
BROAD = 1.0
# Surfaces of fewer points are evaluated together, up to this many points at once.
TOGETHER = 1 << 13
# The number of times that the search for the brightest and the darkest point of the box follows each axis.
CLIMBS = 2


@dataclass(frozen=True, eq=False)
class Bounds:
    """The limits of N fragments, in linear light that is not yet multiplied by alpha.

    value: the light (N, 3), computed in float64 from the exact attributes.
    below: the largest decrease (N, 3) of the light that the errors of the attributes can cause.
    above: the largest increase (N, 3) of the light that the errors of the attributes can cause.
    level: the part (N, 3) of below and above that comes from the level of detail of textures.
    rounding: the largest difference (N, 3) that was found between the light computed in float32 and in float64.
    magnitude: the absolute value (N, 3) of the light, or the sum of those of its terms where bands of wavelengths are added.
        With more than SUMMED lights it is multiplied by their number / SUMMED.
    arriving: the absolute value (N, 3) of the light that arrives at the surface from all lights.
    alpha: alpha (N,), computed in float64.
    alpha_low: the least possible alpha (N,).
    alpha_high: the largest possible alpha (N,).
    """

    value: Array
    below: Array
    above: Array
    level: Array
    rounding: Array
    magnitude: Array
    arriving: Array
    alpha: Array
    alpha_low: Array
    alpha_high: Array

    def arithmetic(self, scale: float) -> Array:
        """Returns the error tau (N, 3) of the shading's arithmetic. scale: the picture's brightest value, at most 1."""
        flushed = TINY * (1 + MAGNIFIED * self.arriving)
        result: Array = AGAIN * self.rounding + STEPS * np.maximum(self.magnitude, scale) + flushed
        return result

    def interval(self, scale: float) -> tuple[Array, Array]:
        """Returns the allowed colours (least, largest), each (N, 4), premultiplied. scale: the picture's brightest value, at
        most 1.
        """
        tau = self.arithmetic(scale)
        low, high = self.value - self.below - tau, self.value + self.above + tau
        ends = [end * alpha[:, None] for end in (low, high) for alpha in (self.alpha_low, self.alpha_high)]
        low, high = np.minimum.reduce(ends), np.maximum.reduce(ends)
        return np.column_stack([low, self.alpha_low]), np.column_stack([high, self.alpha_high])

    def centre(self) -> Array:
        """Returns the colours (N, 4) in float64, premultiplied."""
        return np.column_stack([self.value * self.alpha[:, None], self.alpha])

    @classmethod
    def empty(cls, count: int) -> Bounds:
        """Limits of `count` fragments, all 0, to be filled in."""
        flat = {"alpha", "alpha_low", "alpha_high"}
        return cls(**{f.name: np.zeros(count if f.name in flat else (count, 3)) for f in fields(cls)})


def alphas(
    inputs: Inputs, fragments: Fragments, driver: Freedom = LLVMPIPE, anywhere: Flags | None = None
) -> tuple[Array, Array, Array]:
    """Returns alpha before a cut-out compares it with its cutoff: (exact, least possible, largest possible value), each (N,).

    inputs: the scene with its uploaded values.
    fragments: fragments of any draws in any order.
    driver: the errors of the driver's fixed functions.
    anywhere: optional (N,); True for fragments that may not cover all samples of their pixels, and so may be shaded beside the
        pixel's centre.
    """
    result = np.ones((3, len(fragments)))
    for draw, indices, part in by_structure(inputs, fragments):
        if draw.alpha_mode != "opaque":
            for which, extent in _places(indices, anywhere, inputs.extent):
                pieces = part.take(which)
                planes = Planes(draw, pieces, inputs.size, driver)
                surface, errors = _attributes(draw, pieces, planes, driver, extent)
                result[:, indices[which]] = _alphas(draw, surface, errors, driver)
    return result[0], result[1], result[2]


def fragment_bounds(inputs: Inputs, fragments: Fragments, driver: Freedom = LLVMPIPE, anywhere: Flags | None = None) -> Bounds:
    """Returns the limits between which a driver may show the light and the alpha of fragments.

    inputs: the scene with its uploaded values.
    fragments: fragments of any draws in any order.
    driver: the errors of the driver's fixed functions.
    anywhere: as for `alphas`.
    """
    result = Bounds.empty(len(fragments))
    for draw, indices, part in by_structure(inputs, fragments):
        for which, extent in _places(indices, anywhere, inputs.extent):
            limits = _limits(draw, part.take(which), inputs.size, driver, extent)
            for name, values in limits.items():
                getattr(result, name)[indices[which]] = values
    return result


def _places(indices: NDArray[np.intp], anywhere: Flags | None, extent: float) -> list[tuple[NDArray[np.intp], float]]:
    """Returns pairs of places in `indices` (K,) and half the side of the square in which the fragments there may be shaded.

    A fragment is shaded at its pixel's centre if it covers all samples. With several samples per pixel, a fragment that may
    cover only some of them may be shaded anywhere within the pixel and the triangle (`centroid`, GLSL 4.60, 4.5).
    indices: the numbers (K,) of some fragments.
    anywhere: optional (N,); True for fragments that may not cover all samples of their pixels.
    extent: half the side of the square in which a pixel has its samples [pixels].
    """
    if not extent or anywhere is None:
        return [(np.arange(len(indices)), 0.0)]
    parts = [(np.flatnonzero(~anywhere[indices]), 0.0), (np.flatnonzero(anywhere[indices]), extent)]
    return [(which, square) for which, square in parts if len(which)]


def _limits(draw: Draw, fragments: Fragments, size: tuple[int, int], driver: Freedom, extent: float) -> dict[str, Array]:
    """Returns the fields of Bounds by name for N fragments of one draw.

    draw: the instance that is drawn.
    fragments: N fragments of the draw.
    size: width and height of the picture [pixels].
    driver: the errors of the driver's fixed functions.
    extent: half the side of the square round the pixel's centre in which the fragments may be shaded [pixels].
    """
    planes = Planes(draw, fragments, size, driver)
    if draw.instance.rate == "phong":
        limits = _per_pixel(draw, fragments, planes, driver, extent)
    elif draw.instance.rate == "gouraud":
        limits = _per_vertex(draw, fragments, planes, extent)
    else:
        limits = _per_face(draw, fragments, driver)
    alpha = np.ones((3, len(fragments)))
    if draw.alpha_mode == "blend":
        alpha = _alphas(draw, *_attributes(draw, fragments, planes, driver, extent), driver)
    return {**limits, **dict(zip(("alpha", "alpha_low", "alpha_high"), alpha, strict=True))}


@dataclass(frozen=True, eq=False)
class _Errors:
    """The errors of a Surface's attributes. Each has the shape of its attribute, or is None if the attribute has no effect.

    level: the least and the largest number (N,) to add to the level of detail.
    share: for attributes that are not known in a square, the largest ratio (N,) of a driver's error to half of the range.
    table: the error of the weights of the filter that reads the model's tables [texels].
    """

    position: Array | None = None
    normal: Array | None = None
    tangent: Array | None = None
    uv: Array | None = None
    colour: Array | None = None
    level: tuple[Array, Array] | None = None
    share: Array | None = None
    table: float = 0.0


def _attributes(draw: Draw, fragments: Fragments, planes: Planes, driver: Freedom, extent: float) -> tuple[Surface, _Errors]:
    """Returns interpolated attributes and their errors.

    If a fragment may be shaded anywhere in a square, its attributes are in the middle of their ranges there, and half of the
    range counts as an error. Texture coordinates, which are not declared `centroid`, may also be those of a place beside the
    triangle.
    draw: the instance that is drawn.
    fragments: N fragments of the draw.
    planes: the plane equations of their triangles.
    driver: the errors of the driver's fixed functions.
    extent: as for `_limits`.
    """
    surface = surface_at(draw, fragments, planes.size, AT_CENTRE)
    vertices, place = np.unique(planes.corners, return_inverse=True)
    corner = at_vertices(draw, vertices, np.float64)
    place = place.reshape(-1, 3)
    errors: dict[str, Any] = {}
    middles: dict[str, Any] = {}

    def add(name: str, vertex: Array | float, columns: slice = slice(None)) -> None:
        """Adds the errors of one attribute, whose errors at the corners are `vertex`."""
        values = getattr(corner, name)[place][..., columns]
        if extent:
            middles[name] = getattr(surface, name).copy()
            middles[name][:, columns], half, error = planes.over_square(values, vertex, extent)
            errors[name] = half + error
            errors["share"] = np.maximum(errors.get("share", 0.0), error.max(axis=1) / np.maximum(half.max(axis=1), TINY))
        else:
            errors[name] = planes.errors(values, vertex)

    if _positions_matter(draw):
        add("position", driver.window * U * planes.world)
    if draw.lamps or draw.surrounds:
        add("normal", UNIT)
        if corner.tangent is not None:
            add("tangent", UNIT, slice(3))
    if corner.colour is not None:
        add("colour", 0.0)
    if corner.uv is not None and surface.footprint is not None:
        # The driver wraps a texture coordinate, scales it and subtracts half a texel. Each of these operations rounds relative
        # to the whole side of the texture.
        errors["uv"] = planes.errors(corner.uv[place], 4 * U)
        # With several samples, they may be those of any place in the pixel, within the triangle or not (GLSL 4.60, 4.5).
        right, down = surface.footprint
        errors["uv"] = errors["uv"] + extent * (np.abs(right) + np.abs(down))
        if driver.texel:
            largest_texel = max(1 / sampler.size.min() for sampler in draw.pictures)
            errors["uv"] = errors["uv"] + driver.texel * largest_texel
        errors["uv"] = errors["uv"] + _placing(draw, surface, driver)
        errors["level"] = _levels(draw, fragments, surface, planes.size, driver)
    return replace(surface, **middles), _Errors(**errors, table=driver.table)


def _vertex_errors(draw: Draw, surface: Surface, vertices: NDArray[np.intp], driver: Freedom) -> _Errors:
    """Returns the errors of attributes that the vertex stage computes.

    draw: the instance that is drawn.
    surface: the exact attributes at the vertices.
    vertices: the indices (N,) of the vertices in the mesh.
    driver: the errors of the driver's fixed functions.
    """
    unit = np.full(surface.normal.shape, UNIT) if draw.lamps or draw.surrounds else None
    return _Errors(
        position=driver.window * U * draw.world_terms[vertices] if _positions_matter(draw) else None,
        normal=unit,
        tangent=unit if surface.tangent is not None else None,
        uv=_coordinates(draw, surface, driver),
        table=driver.table,
    )


def _coordinates(draw: Draw, surface: Surface, driver: Freedom) -> Array | None:
    """Returns the errors (N, 2) of the texture coordinates at which the vertex stage reads textures.

    The result is None for textures that are all smooth and not placed by a matrix: their colours change so little with the
    coordinates that the rounding of the shading covers it.
    """
    placed = any(sampler.placement is not None for sampler in draw.pictures)
    nearest = [sampler for sampler in draw.pictures if sampler.filter == "nearest"]
    if surface.uv is None or not (placed or nearest):
        return None
    error = np.full_like(surface.uv, 4 * U)
    if not placed:
        # A vertex often lies exactly on the border of two texels. No operation rounds such a coordinate.
        for sampler in nearest:
            at = surface.uv * sampler.size
            error[at == np.rint(at)] = 0.0
    return error + _placing(draw, surface, driver)


def _placing(draw: Draw, surface: Surface, driver: Freedom) -> Array:
    """Returns the errors (N, 2) of a mesh's texture coordinates that stand for the errors of those that a matrix makes of them.

    Each coordinate is a sum of three terms. Its wrapping and scaling then round relative to the whole side of the texture.
    draw: the instance that is drawn.
    surface: N points with the exact texture coordinates of the mesh.
    driver: the errors of the driver's fixed functions.
    """
    uv = surface.uv
    assert uv is not None
    worst = np.zeros_like(uv)
    for sampler in draw.pictures:
        if sampler.placement is not None:
            linear, offset = sampler.placement[:, :2], sampler.placement[:, 2]
            terms = np.abs(uv) @ np.abs(linear).T + np.abs(offset)
            error = 4 * U * (terms + 1) + driver.texel / sampler.size.min()
            worst = np.maximum(worst, error @ np.abs(np.linalg.inv(linear)).T)
    return worst


def _beside_borders(draw: Draw, surface: Surface, error: Array) -> NDArray[np.intp]:
    """Returns the points whose coordinates, with their errors (N, 2), may lie in several texels of a texture that is nearest.

    The driver may show any of these texels.
    """
    beside = np.zeros(len(error), dtype=np.bool_)
    for sampler in draw.pictures:
        if sampler.filter == "nearest" and surface.uv is not None:
            linear = np.eye(2) if sampler.placement is None else sampler.placement[:, :2]
            at, reach = sampler.coordinates(surface.uv), error @ np.abs(linear).T
            first, last = (np.floor((at + sign * reach) * sampler.size) for sign in (-1, 1))
            beside |= (first != last).any(axis=1)
    return np.flatnonzero(beside)


def _in_all_texels(surface: Surface, errors: _Errors) -> Iterator[Surface]:
    """Yields the surface with its texture coordinates, and their level of detail, at places all over their errors.

    A texture that is nearest is magnified, so that a pixel spans at most one texel: no texel lies between two places.
    """
    assert errors.uv is not None
    across, up = (_spaced(-error, error, SHIFTS) for error in errors.uv.T)
    for u, v in product(across, up):
        moved = _moved(_moved(surface, "uv", 0, u), "uv", 1, v)
        for level in (surface.level, *(errors.level or ())):
            yield replace(moved, level=level)


def _positions_matter(draw: Draw) -> bool:
    """Returns whether the light depends on the position of the surface."""
    return any("position" in lamp.values for lamp in draw.lamps) or (bool(draw.lamps) and draw.viewer is None)


def _per_pixel(draw: Draw, fragments: Fragments, planes: Planes, driver: Freedom, extent: float) -> dict[str, Array]:
    """Returns the fields of Bounds by name, without those of alpha, for fragments that are shaded per pixel."""
    surface, errors = _attributes(draw, fragments, planes, driver, extent)
    side = np.where(fragments.front | (not draw.instance.back_faces), 1.0, -1.0)
    surface = replace(surface, side=side)
    if not extent:
        return _spread(draw, evaluate_surface, surface, errors)
    if errors.uv is None:
        return _over_patches(draw, fragments, surface, errors, planes, extent)
    return _searched(draw, fragments, surface, errors, planes.size, extent)


def _searched(
    draw: Draw, fragments: Fragments, surface: Surface, errors: _Errors, size: tuple[int, int], extent: float
) -> dict[str, Array]:
    """Returns the fields of Bounds by name, without those of alpha, from the boxes of possible attributes in a square.

    Where the light is curved, it is evaluated at GRID x GRID places as well.
    surface: attributes in the middle of their ranges in the square.
    errors: half of these ranges, and the driver's errors.
    """

    def patch(which: NDArray[np.intp]) -> Iterator[Surface]:
        part, points = fragments.take(which), part_of(surface, which)
        return on_grid(draw, part, points, size, extent, GRID, inside=True)

    return _spread(draw, evaluate_surface, surface, errors, patch)


def _over_patches(
    draw: Draw, fragments: Fragments, surface: Surface, errors: _Errors, planes: Planes, extent: float
) -> dict[str, Array]:
    """Returns the fields of Bounds by name, without those of alpha, for fragments that may be shaded anywhere in a square.

    Small triangles are shaded as a whole, and once for all the pixels that they touch. Over large ones, the square is shaded,
    although some of it lies beside the triangle, where the attributes are extrapolated by little. What is left are needles and
    triangles near the horizon.
    surface, errors: as for `_searched`.
    """
    window = planes.window
    longest = np.linalg.norm(np.roll(window, -1, axis=1) - window, axis=2).max(axis=1)
    small = planes.whole & (np.ptp(window, axis=1).max(axis=1) <= SMALL)
    broad = planes.whole & ~small & (longest >= BROAD * slimness(window))
    result: dict[str, Array] = {}

    def add(which: NDArray[np.intp], limits: dict[str, Array]) -> None:
        for name, values in limits.items():
            result.setdefault(name, np.zeros((len(fragments), *values.shape[1:])))[which] = values

    at = planes.place
    tiny, wide, other = (np.flatnonzero(flags) for flags in (small[at], broad[at], ~(small | broad)[at]))
    if len(tiny):
        _, first, group = np.unique(2 * at[tiny] + (surface.side[tiny] > 0), return_index=True, return_inverse=True)
        part = tiny[first]
        points = on_triangles(draw, fragments.take(part), part_of(surface, part))
        found = light_range(draw, points, TRIANGLE_LINES, narrowed)
        found = Range(*(getattr(found, f.name)[group.reshape(-1)] for f in fields(Range)))
        add(tiny, _ranged(draw, part_of(surface, tiny), _share(errors, tiny), found, errors.table))
    if len(wide):
        points = on_grid(draw, fragments.take(wide), part_of(surface, wide), planes.size, extent, 3, inside=False)
        found = light_range(draw, points, GRID_LINES, narrowed)
        add(wide, _ranged(draw, part_of(surface, wide), _share(errors, wide), found, errors.table))
    if len(other):
        add(other, _searched(draw, fragments.take(other), part_of(surface, other), _taken(errors, other), planes.size, extent))
    return result


def _share(errors: _Errors, which: NDArray[np.intp]) -> Array:
    """Returns the share (K, 1) of attributes' ranges, at most 1, that the driver's errors of the attributes make up."""
    share = np.zeros(len(which)) if errors.share is None else np.minimum(errors.share[which], 1.0)
    result: Array = share[:, None]
    return result


def _ranged(draw: Draw, surface: Surface, share: Array, found: Range, weight: float) -> dict[str, Array]:
    """Returns the fields of Bounds by name, without those of alpha, for the light's range over patches.

    A driver's errors of the attributes change the light by at most their share of the attributes' ranges. An attribute that
    does not change in the square has errors of a few roundings, which count like the roundings of the shading.
    weight: the error of the weights of the filter that reads the model's tables [texels].
    """
    room = share * (found.high - found.low) + AGAIN * found.rounding
    if draw.tables:
        room += np.maximum(*_read_beside(draw, evaluate_surface, surface, evaluate_surface(draw, surface), weight))
    value, half = (found.low + found.high) / 2, (found.high - found.low) / 2 + room
    return {
        "value": value,
        "below": half,
        "above": half,
        "level": np.zeros_like(value),
        "rounding": found.rounding,
        "arriving": light_at(draw, surface),
        "magnitude": _magnitude(draw, surface, value),
    }


def _per_vertex(draw: Draw, fragments: Fragments, planes: Planes, extent: float) -> dict[str, Array]:
    """Returns the fields of Bounds by name, without those of alpha, for fragments with light interpolated from the corners."""
    corners = draw.triangles[fragments.triangle]
    x, y = places(fragments, planes.size, AT_CENTRE)
    weight = weights(draw, fragments.triangle, x, y, planes.size, derivatives=False).values
    result: dict[str, Array] = {}
    back = ~fragments.front & draw.instance.back_faces
    interpolation = np.zeros((len(fragments), 3))
    for side in (1.0, -1.0):
        indices = np.flatnonzero(back == (side < 0))
        if not len(indices):
            continue
        vertices, place = np.unique(corners[indices], return_inverse=True)
        place = place.reshape(-1, 3)
        surface = replace(at_vertices(draw, vertices, np.float64), side=np.full(len(vertices), side))
        limits = _spread(draw, evaluate_surface, surface, _vertex_errors(draw, surface, vertices, planes.driver))
        for name, values in limits.items():
            # Anywhere in a square, no error is larger than the largest at a corner.
            by = weight[indices] if name == "value" else np.abs(weight[indices])
            at = values[place].max(axis=1) if extent else blend(by, values[place])
            result.setdefault(name, np.zeros((len(fragments), 3)))[indices] = at
        # Triangles that show only the other side get meaningless plane equations here; their errors are not used.
        table = np.zeros((len(draw.clip), 3))
        table[vertices] = limits["value"]
        if extent:
            middle, half, error = planes.over_square(table[planes.corners], 0.0, extent)
            result["value"][indices], interpolation[indices] = middle[indices], (half + error)[indices]
        else:
            interpolation[indices] = planes.errors(table[planes.corners], 0.0)[indices]
    # A driver flushes the slope of a plane equation to 0 if it is smaller than TINY, and in perspective it interpolates light
    # divided by w. Across the picture, this slope adds up.
    interpolation += TINY * sum(planes.size) * max(1.0, float(np.abs(draw.clip[:, 3]).max(initial=0.0)))
    result["below"], result["above"] = result["below"] + interpolation, result["above"] + interpolation
    return result


def _per_face(draw: Draw, fragments: Fragments, driver: Freedom) -> dict[str, Array]:
    """Returns the fields of Bounds by name, without those of alpha, for fragments of triangles shaded at their centroid."""
    faces, place = np.unique(fragments.triangle, return_inverse=True)
    vertices = draw.triangles[faces, 2]
    surface = at_vertices(draw, vertices, np.float64, centroids=True)

    def seen(draw: Draw, surface: Surface, material: Any = None) -> Array:
        if draw.instance.back_faces:
            facing = np.einsum("ij,ij->i", surface.normal, toward_viewer(draw, surface.position)) >= 0
            surface = replace(surface, side=np.where(facing, 1.0, -1.0).astype(surface.normal.dtype))
        return evaluate_surface(draw, surface, material)

    limits = _spread(draw, seen, surface, _vertex_errors(draw, surface, vertices, driver))
    return {name: values[place] for name, values in limits.items()}


def _spread(
    draw: Draw,
    evaluate: Callable[..., Array],
    surface: Surface,
    errors: _Errors,
    patch: Callable[[NDArray[np.intp]], Iterator[Surface]] | None = None,
) -> dict[str, Array]:
    """Returns the fields of Bounds by name, without those of alpha.

    The model is evaluated at the exact surface, at surfaces whose attributes are perturbed, and in float32.
    draw: the instance that is drawn.
    evaluate: a function that returns the light (N, 3). Its arguments are draw, surface and, optionally, material.
    surface: the exact attributes.
    errors: their errors.
    patch: optional, for errors as large as a pixel; a function that yields the true points of some fragments on a square grid.
        Where the light is curved, these tell more than the corners of the errors' boxes.
    """
    surface = by_columns(surface)
    material = material_of(draw, surface)
    value = evaluate(draw, surface, material)
    below, above = np.zeros_like(value), np.zeros_like(value)
    rounding = np.abs(evaluate(draw, narrowed(surface)) - value)

    def widen(values: list[Array], margin: Array | float = 0.0) -> None:
        """Widens below and above by the deviations of the values, each of which is uncertain by the margin."""
        np.add(below, np.maximum(value - (np.minimum.reduce(values) - margin), 0), out=below)
        np.add(above, np.maximum(np.maximum.reduce(values) + margin - value, 0), out=above)

    curved = np.zeros(len(value), dtype=np.bool_)
    for name in ("normal", "position", "tangent"):
        error = getattr(errors, name)
        if error is not None:
            low, high, uncertain, bent = over_box(draw, evaluate, surface, name, error, value, material, patch is None)
            rounding = np.maximum(rounding, uncertain)
            curved |= bent
            widen([low, high])
    which = np.flatnonzero(curved)
    if patch is not None and len(which):
        light = np.stack(_evaluated(draw, evaluate, patch(which)))
        grid = light.reshape(GRID, GRID, *light.shape[1:])
        margin = np.maximum(_between(list(grid)).max(axis=0), _between(list(grid.swapaxes(0, 1))).max(axis=0))
        below[which] += np.maximum(value[which] - light.min(axis=0) + margin, 0)
        above[which] += np.maximum(light.max(axis=0) + margin - value[which], 0)
    for axis, error in enumerate([] if errors.uv is None else errors.uv.T):
        # Filtered textures have a kink at the middle of every texel, so the ends of the error are not enough.
        shifts = _spaced(-error, error, SHIFTS)
        values = _evaluated(draw, evaluate, (_moved(surface, "uv", axis, shift) for shift in shifts))
        widen(values, _between(values))
    beside = _beside_borders(draw, surface, errors.uv) if errors.uv is not None else which[:0]
    if len(beside):
        light = np.stack(_evaluated(draw, evaluate, _in_all_texels(part_of(surface, beside), _taken(errors, beside))))
        below[beside] += np.maximum(value[beside] - light.min(axis=0), 0)
        above[beside] += np.maximum(light.max(axis=0) - value[beside], 0)
    if draw.tables:
        less, more = _read_beside(draw, evaluate, surface, value, errors.table)
        below += less
        above += more
    if errors.colour is not None and surface.colour is not None:
        widen([evaluate(draw, replace(surface, colour=surface.colour + sign * errors.colour)) for sign in (-1, 1)])
    for ends in _decoded(draw):
        widen([evaluate(end, surface) for end in ends])
    level = np.zeros_like(value)
    if errors.level is not None:
        offsets = _spaced(*errors.level, LEVELS)
        # Textures of different sizes have different errors of their levels.
        for of_textures in draw.grids:
            values = _evaluated(draw, evaluate, (replace(surface, level=offset, grid=of_textures) for offset in offsets))
            margin = _between(values)
            widen(values, margin)
            level += np.maximum.reduce([np.abs(other - value) for other in values]) + margin
    return {
        "value": value,
        "below": below,
        "above": above,
        "level": level,
        "rounding": rounding,
        "arriving": light_at(draw, surface),
        "magnitude": _magnitude(draw, surface, value),
    }


def _magnitude(draw: Draw, surface: Surface, value: Array) -> Array:
    """Returns `Bounds.magnitude` (N, 3). value: the light (N, 3)."""
    size = np.maximum(np.abs(value), added_light(draw, surface)) if draw.shares else np.abs(value)
    result: Array = size * max(1.0, len(draw.lamps + draw.surrounds) / SUMMED)
    return result


def _read_beside(
    draw: Draw, evaluate: Callable[..., Array], surface: Surface, value: Array, weight: float
) -> tuple[Array, Array]:
    """Returns how much less and how much more light, (N, 3) each, a driver may show because of how it reads the model's tables.

    The coordinates round relative to the whole side of a table. Filtered values have a kink at the middle of every texel, so
    the ends of the error are not enough.
    draw, evaluate, surface: as in _spread.
    value: the light (N, 3) that the exact tables give.
    weight: the error of the filter's weights [texels].
    """
    below, above = np.zeros_like(value), np.zeros_like(value)
    for table in draw.tables:
        for axis, count in enumerate(table.size):
            step = (weight + 4 * U * count) * (np.arange(3) == axis)

            def moved(read: Volume, by: Array, digest: str = table.digest) -> Volume:
                return replace(read, shift=tuple(by)) if read.digest == digest else read

            ends = [evaluate(draw.with_tables(partial(moved, by=sign * step)), surface) for sign in (-1.0, 1.0)]
            margin = _between([ends[0], value, ends[1]])
            below += np.maximum(value - np.minimum.reduce(ends) + margin, 0)
            above += np.maximum(np.maximum.reduce(ends) - value + margin, 0)
    return below, above


def _decoded(draw: Draw) -> Iterator[tuple[Draw, ...]]:
    """Yields, for each texture of sRGB codes whose decoding has an error, the draw with that texture darkest and brightest."""
    every = (sampler for part in (draw, *draw.shares) for sampler in part.samplers.values() if sampler.decoding)
    for sampler in {id(sampler): sampler for sampler in every}.values():
        yield tuple(draw.with_samplers(partial(_exchanged, sampler, end)) for end in sampler.extremes)


def _exchanged(one: Sampler, other: Sampler, sampler: Sampler) -> Sampler:
    """Returns the other texture in place of one texture; all others as they are."""
    return other if sampler is one else sampler


def over_box(
    draw: Draw,
    evaluate: Callable[..., Array],
    surface: Surface,
    name: str,
    error: Array,
    value: Array,
    material: Any,
    search: bool = True,
) -> tuple[Array, Array, Array, Flags]:
    """Returns (low, high, rounding, curved) of a box of possible attributes.

    The errors of a vector's three components make a box round its exact value. low and high are the least and the largest light
    (N, 3) over the box, rounding is the largest rounding error (N, 3), and curved says whether (N,) a peak may lie in the box.
    draw, evaluate, surface: as in _spread.
    name: the attribute: normal, position or tangent.
    error: the errors (N, 3) of its first three components, half the sides of the box.
    value: the light (N, 3) at the exact attribute.
    material: the material of the surface's points, which does not depend on the attribute.
    search: whether to look for the peak where there may be one.
    """

    def moved(points: Surface, by: Array) -> Surface:
        vector = getattr(points, name).copy(order="K")
        vector[:, :3] += by
        return replace(points, **{name: vector})

    rounding = np.zeros_like(value)
    diagonals = [error * (1.0, *signs) for signs in product((-1.0, 1.0), repeat=2)]
    # All corners of the box of normals are tried, so that a lobe is evaluated on both sides of its horizon. Positions and
    # tangents seldom matter as much, and a linear function changes by the sum of its changes along the axes.
    directions = diagonals if name == "normal" else [error * (np.arange(3) == axis) for axis in range(3)]
    opposite = (moved(surface, sign * direction) for direction in directions for sign in (-1.0, 1.0))
    light = _evaluated(draw, evaluate, opposite, material)
    ends = [np.stack(light[first : first + 2]) for first in range(0, len(light), 2)]
    if name == "normal":
        # Two opposite corners are enough to see whether the rounding error is larger beside the exact normal.
        corners = (narrowed(moved(surface, sign * directions[2])) for sign in (-1.0, 1.0))
        rounding = np.abs(np.stack(_evaluated(draw, evaluate, corners)) - ends[2]).max(axis=0)
    if name == "normal":
        low, high = np.minimum.reduce(ends).min(axis=0), np.maximum.reduce(ends).max(axis=0)
    else:
        low = value - sum(np.maximum(value - pair.min(axis=0), 0) for pair in ends)
        high = value + sum(np.maximum(pair.max(axis=0) - value, 0) for pair in ends)
    # If the values at opposite ends are not symmetric about the central value, a peak or a horizon may lie inside the box.
    bend = np.maximum.reduce([np.abs(pair.sum(axis=0) - 2 * value) for pair in ends])
    curved = (bend > BENT * (high - low) + TINY).any(axis=1)
    # A light within or beside a box of positions makes a peak that may lie symmetrically between the corners.
    places = [lamp.values["position"] for lamp in draw.lamps if "position" in lamp.values] if name == "position" else []
    towards = [place - surface.position for place in places]
    for toward in towards:
        curved |= np.linalg.norm(toward, axis=1) < CLOSE * error.max(axis=1)
    bent = np.flatnonzero(curved)
    if search and len(bent):
        points = part_of(surface, bent)
        least, largest = _search(
            lambda offsets: _evaluated(draw, evaluate, (moved(points, offset) for offset in offsets)),
            error[bent],
            [diagonal[bent] for diagonal in diagonals],
            [toward[bent] for toward in towards],
        )
        low[bent], high[bent] = np.minimum(low[bent], least), np.maximum(high[bent], largest)
    return low, high, rounding, curved


def _evaluated(draw: Draw, evaluate: Callable[..., Array], surfaces: Iterable[Surface], material: Any = None) -> list[Array]:
    """Returns the light (N, 3) of each of several surfaces with N points.

    To evaluate a model takes about as long for one point as for a thousand, so that small surfaces are evaluated together. A
    text takes so long that it is run for all surfaces at once.
    material: optional, the material of all surfaces.
    """
    light: list[Array] = []
    several = iter(surfaces)
    for surface in several:
        together = TOGETHER // max(len(surface.position), 1)
        some = [surface, *islice(several, None if draw.text is not None else max(together - 1, 0))]
        if len(some) == 1:
            light.append(evaluate(draw, surface, material))
        else:
            shared = None if material is None else repeated(draw, material, len(some))
            light += list(evaluate(draw, joined(some), shared).reshape(len(some), -1, 3))
    return light


def _search(
    light: Callable[[list[Array]], list[Array]], half: Array, diagonals: list[Array], towards: list[Array]
) -> tuple[Array, Array]:
    """Returns the least and the largest light, each (N, 3), that is found on lines through N boxes.

    light: takes offsets (N, 3) from the middles of the boxes, several of them, and returns the light (N, 3) at each.
    half: half the sides of the boxes (N, 3).
    diagonals: the offsets (N, 3) of the boxes' corners, one for each diagonal.
    towards: the offsets (N, 3) of the lights that may make a peak.
    """
    lows, highs = [], []

    def sample(centre: Array, direction: Array) -> tuple[Array, Array]:
        """Samples the line from centre - direction to centre + direction: (offsets, light), (LEVELS, N, 3) each."""
        offsets = _spaced(centre - direction, centre + direction, LEVELS)
        along = light(offsets)
        margin = _between(along)
        lows.append(np.minimum.reduce(along) - margin)
        highs.append(np.maximum.reduce(along) + margin)
        return np.stack(offsets), np.stack(along)

    def extreme(offsets: Array, along: Array, sign: float) -> Array:
        """Returns the offset (N, 3) at which sign times the light, summed over the channels, is largest."""
        best = (sign * along.sum(axis=2)).argmax(axis=0)
        found: Array = offsets[best, np.arange(len(best))]
        return found

    middle = np.zeros_like(half)
    lines = [sample(middle, direction) for direction in (*diagonals, *(np.clip(toward, -half, half) for toward in towards))]
    offsets, along = (np.concatenate(parts) for parts in zip(*lines, strict=True))
    # From the brightest and from the darkest of these points, lines along the axes lead to a peak or to a dip.
    for sign in (-1.0, 1.0):
        centre = extreme(offsets, along, sign)
        for axis in list(range(3)) * CLIMBS:
            line = half * (np.arange(3) == axis)
            centre = extreme(*sample(np.where(line > 0, 0.0, centre), line), sign)
    return np.minimum.reduce(lows), np.maximum.reduce(highs)


def _alphas(draw: Draw, surface: Surface, errors: _Errors, driver: Freedom) -> Array:
    """Returns alpha (3, N): its exact value, its least possible value and its largest possible value."""
    value = alpha_of(draw, surface)
    others = [value]
    if draw.alpha_sampler is not None and errors.uv is not None:
        for axis in (0, 1):
            shifts = _spaced(-errors.uv[:, axis], errors.uv[:, axis], SHIFTS)
            samples = [alpha_of(draw, _moved(surface, "uv", axis, shift)) for shift in shifts]
            margin = _between(samples)
            others += [np.minimum.reduce(samples) - margin, np.maximum.reduce(samples) + margin]
        if errors.level is not None:
            samples = [alpha_of(draw, replace(surface, level=offset)) for offset in _spaced(*errors.level, LEVELS)]
            margin = _between(samples)
            others += [np.minimum.reduce(samples) - margin, np.maximum.reduce(samples) + margin]
        beside = _beside_borders(draw, surface, errors.uv)
        if len(beside):
            shown = [alpha_of(draw, moved) for moved in _in_all_texels(part_of(surface, beside), _taken(errors, beside))]
            for end in (np.minimum.reduce(shown), np.maximum.reduce(shown)):
                others.append(value.copy())
                others[-1][beside] = end
    # Alpha is a product of three factors; 8 roundings are more than enough.
    slack: Array = 8 * U * np.abs(value)
    if errors.colour is not None and surface.colour is not None:
        others += [alpha_of(draw, replace(surface, colour=surface.colour + sign * errors.colour)) for sign in (-1, 1)]
    low = value - sum(np.maximum(value - other, 0) for other in others) - slack
    high = value + sum(np.maximum(other - value, 0) for other in others) + slack
    return np.stack([value, low, high])


def _levels(
    draw: Draw, fragments: Fragments, surface: Surface, size: tuple[int, int], driver: Freedom
) -> tuple[Array, Array] | None:
    """Returns the least and the largest difference, each (N,), between a driver's level of detail and the exact one.

    The result is None if no texture is minified. The specification's formula has derivatives, but a driver may use differences
    within a square of 2 x 2 pixels in their place (OpenGL 4.6 core, 8.14.1; GLSL 4.60, 8.14.1).
    draw: the instance that is drawn, which has textures.
    fragments: N fragments of the draw.
    surface: their exact attributes.
    size: width and height of the picture [pixels].
    driver: the errors of the driver's fixed functions.
    """
    assert surface.footprint is not None
    exact = [sampler.level(*surface.footprint) for sampler in draw.pictures]
    # The driver's level may be larger than the exact one: by up to 1 by the rule "sum", and by 1 more because of differences.
    if max(level.max(initial=-np.inf) for level in exact) < (-2 if "sum" in driver.rules else -1):
        return None
    vertices, place = np.unique(draw.triangles[fragments.triangle], return_inverse=True)
    at_corners = at_vertices(draw, vertices, np.float64).uv
    assert at_corners is not None
    corner = at_corners[place.reshape(-1, 3)]
    x, y = (np.floor(p / 2) * 2 + 0.5 for p in places(fragments, size, AT_CENTRE))
    uv = {
        (i, j): blend(weights(draw, fragments.triangle, x + i, y + j, size, derivatives=False).values, corner)
        for i, j in product((0, 1), repeat=2)
    }
    footprints = [surface.footprint, *((uv[1, j] - uv[0, j], uv[i, 1] - uv[i, 0]) for i, j in product((0, 1), repeat=2))]
    differences = [
        sampler.level(dx, dy, rule) - level
        for sampler, level in zip(draw.pictures, exact, strict=True)
        for (dx, dy), rule in product(footprints, driver.rules)
    ]
    least, largest = np.minimum.reduce(differences), np.maximum.reduce(differences)
    return least - driver.level, largest + driver.level


def _taken(errors: _Errors, indices: NDArray[np.intp]) -> _Errors:
    """Returns the errors at the points with these indices."""
    values = {f.name: getattr(errors, f.name) for f in fields(errors)}
    level, table = values.pop("level"), values.pop("table")
    taken = {name: None if value is None else value[indices] for name, value in values.items()}
    return _Errors(**taken, table=table, level=None if level is None else (level[0][indices], level[1][indices]))


def _moved(surface: Surface, name: str, axis: int, by: Array) -> Surface:
    """Returns the surface with one component (`axis`) of one attribute (`name`) changed by an array (N,)."""
    values = getattr(surface, name).copy()
    values[:, axis] += by
    return replace(surface, **{name: values})


def _spaced(low: Array, high: Array, count: int) -> list[Array]:
    """`count` arrays (N,), evenly spaced from low to high."""
    return [low + (high - low) * (k / (count - 1)) for k in range(count)]


def _between(samples: list[Array]) -> Array:
    """Returns the largest amount by which a function may exceed the largest of its evenly spaced samples.

    The amount is half of the largest second difference. A function reaches it if it has a kink halfway between two samples, for
    example where one mip level ends and the next begins. A parabola exceeds its samples by only a quarter of the amount.
    """
    s = np.stack(samples)
    bend: Array = np.abs(s[2:] - 2 * s[1:-1] + s[:-2]).max(axis=0)
    return bend / 2


def narrowed(surface: Surface) -> Surface:
    """Returns the surface with all attributes rounded to float32."""
    return mapped(surface, lambda value: value.astype(np.float32) if value.dtype.kind == "f" else value)
