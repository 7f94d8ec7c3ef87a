"""Bounds: within what limits a float32 driver shows a fragment. The rule, and where its figures come from: docs/tolerance.md.

A fragment's attributes are known up to what float32 leaves of vertices and plane equations. The model is evaluated at the
attributes disturbed by that much, and once more in float32, to see what its own arithmetic costs there. One rule for every
model: nothing here knows which one it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.surface import Surface, alpha_of, at_vertices, material_of, shown, toward_viewer
from glshade.reference import clip
from glshade.reference.inputs import Inputs
from glshade.reference.interpolate import blend, weights
from glshade.reference.raster import MARGIN, SUBPIXELS, Fragments
from glshade.reference.shade import AT_CENTRE, by_draw, places, surface_at

Array = NDArray[Any]

# Half the step of float32 at 1: what one rounding costs at most.
U = 2.0**-24
# A unit vector made in the vertex stage: a 3-term dot product, inversesqrt and the product, 1.5 + 1 + 0.5 steps or so.
UNIT = 4 * U
# Of the shading's own arithmetic: the reference in float32 takes other roundings than the driver does, and may be lucky.
AGAIN = 4.0
# ... and what it costs at least: 16 float32 steps of the value, or of the picture's brightest up to 1.
STEPS = 16 * 2 * U
# Denormal numbers are flushed (1.2e-38), and what is multiplied afterwards may be large; nobody sees so little light.
FLUSHED = 1e-30
# How often the level of detail is looked at between the least and the most that it may be.
LEVELS = 9
# ... and a place in a texture between the ends of its error.
SHIFTS = 5
# Where light bends by more than this share of its range over a normal's box, it is looked at in LEVELS places along each
# diagonal, not in corners alone.
BENT = 0.1
# An edge is near a pixel's centre within this [pixels]: the margin of coverage, and the steps that its corners are snapped by.
NEAR = (MARGIN + 2) / SUBPIXELS
# Lower than this [pixels] a triangle may turn over when its corners are snapped, by half a step each, or a whole one.
FLAT = 4 / SUBPIXELS


@dataclass(frozen=True)
class Driver:
    """What is known of a driver's fixed functions; the figures are measured, docs/tolerance.md says how.

    plane: K, roundings of an attribute's plane equation. window: k, roundings of a corner on its way to the window. snap
    [pixels]: how far a corner is moved before attributes are interpolated; 0 where they start from the corners as they are.
    level: how far the level of detail may be off. texel [texels]: step of the texture filter's weights; 0: they are floats.
    """

    name: str = "llvmpipe"
    plane: float = 2.0
    window: float = 2.0
    snap: float = 0.0
    level: float = 0.05
    texel: float = 0.0


LLVMPIPE = Driver()
# What graphics processors are free to do, where none has been measured: attributes from snapped corners, 8-bit filter weights.
HARDWARE = Driver("hardware", snap=1 / SUBPIXELS, level=0.1, texel=1 / 256)


def driver_of(renderer: str) -> Driver:
    """The record for a GL_RENDERER string."""
    return LLVMPIPE if "llvmpipe" in renderer.lower() or not renderer else HARDWARE


@dataclass(frozen=True, eq=False)
class Bounds:
    """Limits of N fragments.

    value (N, 3): linear light, not yet multiplied by alpha. below, above (N, 3): how far less and more it may be because of
    its attributes; level (N, 3): of that, what textures' levels of detail do. rounding (N, 3): |float32 - float64|.
    magnitude (N, 3): of what was added up. alpha, alpha_low, alpha_high (N,).
    """

    value: Array
    below: Array
    above: Array
    level: Array
    rounding: Array
    magnitude: Array
    alpha: Array
    alpha_low: Array
    alpha_high: Array

    def arithmetic(self, scale: float) -> Array:
        """tau (N, 3). scale: the picture's brightest, at most 1."""
        result: Array = AGAIN * self.rounding + STEPS * np.maximum(self.magnitude, scale) + FLUSHED
        return result

    def interval(self, scale: float) -> tuple[Array, Array]:
        """(low, high), each (N, 4), premultiplied."""
        tau = self.arithmetic(scale)
        low, high = self.value - self.below - tau, self.value + self.above + tau
        ends = [end * alpha[:, None] for end in (low, high) for alpha in (self.alpha_low, self.alpha_high)]
        low, high = np.minimum.reduce(ends), np.maximum.reduce(ends)
        return np.column_stack([low, self.alpha_low]), np.column_stack([high, self.alpha_high])

    def centre(self) -> Array:
        """(N, 4), premultiplied."""
        return np.column_stack([self.value * self.alpha[:, None], self.alpha])

    @classmethod
    def empty(cls, count: int) -> Bounds:
        """Room for `count` fragments."""
        flat = {"alpha", "alpha_low", "alpha_high"}
        return cls(**{f.name: np.zeros(count if f.name in flat else (count, 3)) for f in fields(cls)})


def depth_slack(inputs: Inputs, fragments: Fragments, driver: Driver = LLVMPIPE) -> Array:
    """(N,): how far the driver's depth may be from the reference's: its plane equation, and one step of float32."""
    result = np.zeros(len(fragments))
    for draw, which, some in by_draw(inputs, fragments):
        planes = _Planes(draw, some, inputs.size, driver)
        error = planes.depth_error()
        # Seen edge on, a triangle has every depth between its corners.
        result[which] = np.where(planes.flat, 1.0, error) + 4 * U * np.abs(some.depth)
    return result


def alphas(inputs: Inputs, fragments: Fragments, driver: Driver = LLVMPIPE) -> tuple[Array, Array, Array]:
    """(value, low, high), each (N,): what alpha may be, before a cut-out compares it."""
    result = np.ones((3, len(fragments)))
    for draw, which, some in by_draw(inputs, fragments):
        if draw.alpha_mode != "opaque":
            surface = surface_at(draw, some, inputs.size, AT_CENTRE)
            errors = _errors(draw, some, surface, _Planes(draw, some, inputs.size, driver), driver)
            result[:, which] = _alphas(draw, surface, errors, driver)
    return result[0], result[1], result[2]


def bounds(inputs: Inputs, fragments: Fragments, driver: Driver = LLVMPIPE) -> Bounds:
    """The limits of fragments of any draws in any order."""
    result = Bounds.empty(len(fragments))
    for draw, which, some in by_draw(inputs, fragments):
        planes = _Planes(draw, some, inputs.size, driver)
        if draw.instance.rate == "phong":
            found = _per_pixel(draw, some, inputs.size, planes, driver)
        elif draw.instance.rate == "gouraud":
            found = _per_vertex(draw, some, inputs.size, planes)
        else:
            found = _per_face(draw, some, driver)
        for name, values in found.items():
            getattr(result, name)[which] = values
        if draw.alpha_mode == "blend":
            surface = surface_at(draw, some, inputs.size, AT_CENTRE)
            found_alpha = _alphas(draw, surface, _errors(draw, some, surface, planes, driver), driver)
            result.alpha[which], result.alpha_low[which], result.alpha_high[which] = found_alpha
        else:
            result.alpha[which] = result.alpha_low[which] = result.alpha_high[which] = 1.0
    return result


def turnable(inputs: Inputs, fragments: Fragments) -> NDArray[np.bool_]:
    """(N,): which fragments may show either side, since their triangle is no higher than a step or two."""
    result = np.zeros(len(fragments), dtype=np.bool_)
    for draw, which, some in by_draw(inputs, fragments):
        if draw.instance.back_faces:
            planes = _Planes(draw, some, inputs.size, LLVMPIPE)
            result[which] = planes.thin[planes.place]
    return result


def sealed(inputs: Inputs, fragments: Fragments) -> NDArray[np.bool_]:
    """(N,): which partial fragments belong to a surface that closes the pixel's neighbourhood among them.

    Triangles that share an edge and lie on either side of it leave no gap there, whichever of them a driver draws: a
    fragment counts as long as each edge near its pixel has such a neighbour that counts too.
    """
    alive = np.zeros(len(fragments), dtype=np.bool_)
    owner, keys, senses = [], [], []
    for number, draw in enumerate(inputs.draws):
        which = np.flatnonzero(fragments.draw == number)
        if not len(which):
            continue
        some = fragments.take(which)
        planes = _Planes(draw, some, inputs.size, LLVMPIPE)
        opposite = planes.G[planes.place]
        steepness = np.hypot(opposite[..., 0], opposite[..., 1])
        near = np.abs(np.einsum("nij,nj->ni", opposite, planes.at)) <= NEAR * steepness
        alive[which] = near.any(axis=1) & ~planes.flat & ~planes.thin[planes.place]
        vertices, place = np.unique(planes.corners, return_inverse=True)
        # Vertices at one place are one, whatever else they carry.
        _, place_id = np.unique(draw.instance.mesh.positions[vertices] + 0.0, axis=0, return_inverse=True)
        corner = place_id.reshape(-1)[place.reshape(-1, 3)][planes.place]
        for k in range(3):
            mine = np.flatnonzero(near[:, k])
            a, b = corner[mine, (k + 1) % 3], corner[mine, (k + 2) % 3]
            owner.append(which[mine])
            keys.append(np.column_stack([some.pixel[mine], np.full(len(mine), number), np.minimum(a, b), np.maximum(a, b)]))
            senses.append((a < b) == some.front[mine])
    if not owner:
        return alive
    of, sense = np.concatenate(owner), np.concatenate(senses)
    _, edge = np.unique(np.concatenate(keys), axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    while True:
        there = alive[of]
        sides = np.zeros((int(edge.max(initial=-1)) + 1, 2), dtype=np.bool_)
        sides[edge[there], sense[there].astype(np.intp)] = True
        lonely = there & ~sides[edge].all(axis=1)
        if not lonely.any():
            return alive
        alive[of[lonely]] = False


class _Planes:
    """The plane equations over the window of fragments' triangles: attribute / w = A . (x, y, 1), A = sum(a_i G_i).

    triangles (T,), place (N,): which of them. G (T, 3, 3). w (N,): at the fragments. flat (N,): seen edge on. reach (N, 2):
    how far a fragment's place may be off [pixels].
    """

    def __init__(self, draw: Draw, fragments: Fragments, size: tuple[int, int], driver: Driver) -> None:
        self.driver, self.size = driver, size
        self.triangles, self.place = np.unique(fragments.triangle, return_inverse=True)
        self.corners = draw.triangles[self.triangles]
        at = draw.clip[self.corners]
        w = at[..., 3]
        half = 0.5 * np.array(size)
        rows = np.stack([half[0] * (at[..., 0] + w), half[1] * (at[..., 1] + w), w], axis=-1)
        across = np.stack([np.cross(rows[:, i], rows[:, j]) for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
        volume = np.einsum("ij,ij->i", rows[:, 0], across[:, 0])
        flat = ~(np.abs(volume) > 0)
        self.G = across / np.where(flat, 1.0, volume)[:, None, None]
        x, y = places(fragments, size, AT_CENTRE)
        self.at = np.column_stack([x, y, np.ones(len(x))])
        self.B = self.G.sum(axis=1)[self.place]
        over_w = np.einsum("ij,ij->i", self.B, self.at)
        # Beyond a horizon of its own plane a triangle shows nothing, but the margin may reach there.
        self.flat = flat[self.place] | ~(over_w > 0)
        self.w = 1 / np.where(self.flat, 1.0, over_w)
        self.B_size = np.einsum("ij,ij->i", np.abs(self.B), self.at)
        # From the object to the window: the sums are rounded relative to their terms, the window's place relative to its size.
        matrix = np.abs(draw.world_from_object)
        self.world = np.abs(draw.instance.mesh.positions[self.corners]) @ matrix[:3, :3].T + matrix[:3, 3]
        project = np.abs(draw.clip_from_world)
        terms = (self.world @ project[:, :3].T + project[:, 3]).max(axis=1)[self.place]
        screen = np.abs(self.at[:, :2] / half - 1)
        moved = half * (terms[:, :2] + screen * terms[:, 3:]) / np.abs(self.w)[:, None]
        self.reach = driver.window * U * (max(size) + moved) + driver.snap
        self.z, self.depth_terms = at[..., 2], terms[:, 2:]
        # A needle's plane is the quotient of small differences: L^2 / (2 area) roundings.
        behind = (clip.outside(at) & 0b110000 != 0).any(axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            window = rows[..., :2] / w[..., None]
            sides = window[:, [1, 2, 0]] - window
            double = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
            longest = (sides**2).sum(axis=2).max(axis=1)
            slim = longest / double
            thin = double <= FLAT * np.sqrt(longest)
            self.over_w = 1 / w
        self.slim = np.where(behind | ~np.isfinite(slim), 1.0, slim)
        self.behind, self.thin = behind, thin & ~behind

    def errors(self, corners: Array, vertex: Array | float) -> Array:
        """(N, C): of attributes with the values `corners` (T, 3, C), known to `vertex` (T, 3, C) there."""
        planes = np.einsum("tic,tij->tcj", corners, self.G)[self.place]
        w = self.w[:, None]
        value = w * np.einsum("ncj,nj->nc", planes, self.at)
        size = np.einsum("ncj,nj->nc", np.abs(planes), self.at)
        error = self.driver.plane * U * w * (size + np.abs(value) * self.B_size[:, None])
        slope = np.abs(planes[..., :2] - value[..., None] * self.B[:, None, :2])
        error += np.abs(w) * np.einsum("ncj,nj->nc", slope, self.reach) + 2 * U * np.abs(value)
        span = np.ptp(corners, axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            needle = self.slim[:, None] * np.where(self.behind[:, None], span, np.ptp(corners * self.over_w[..., None], axis=1))
        error += self.driver.plane * U * np.where(self.behind[self.place], 1.0, self.w)[:, None] * needle[self.place]
        error += np.broadcast_to(vertex, corners.shape).max(axis=1)[self.place]
        result: Array = np.where(self.flat[:, None], span[self.place], error)
        return result

    def depth_error(self) -> Array:
        """(N,): of z/w."""
        plane = np.einsum("ti,tij->tj", self.z, self.G)[self.place]
        size = np.einsum("nj,nj->n", np.abs(plane), self.at)
        steepness = np.einsum("nj,nj->n", np.abs(plane[:, :2]), self.reach)
        depth = np.einsum("nj,nj->n", plane, self.at)
        corner = (self.depth_terms[:, 0] + np.abs(depth) * self.depth_terms[:, 1]) / np.abs(self.w)
        result: Array = U * (self.driver.plane * size + self.driver.window * corner) + steepness
        return result


@dataclass(frozen=True, eq=False)
class _Errors:
    """How far each attribute of a Surface may be off, in its shape; None where it does not count. level: least and most (N,)
    of what to add to it."""

    position: Array | None = None
    normal: Array | None = None
    tangent: Array | None = None
    uv: Array | None = None
    colour: Array | None = None
    level: tuple[Array, Array] | None = None


def _errors(draw: Draw, fragments: Fragments, surface: Surface, planes: _Planes, driver: Driver) -> _Errors:
    """Of interpolated attributes."""
    vertices, place = np.unique(planes.corners, return_inverse=True)
    corner = at_vertices(draw, vertices, np.float64)
    place = place.reshape(-1, 3)
    found: dict[str, Any] = {}
    if _places_matter(draw):
        found["position"] = planes.errors(corner.position[place], driver.window * U * planes.world)
    if draw.lamps:
        found["normal"] = planes.errors(corner.normal[place], UNIT)
        if corner.tangent is not None:
            found["tangent"] = planes.errors(corner.tangent[place][..., :3], UNIT)
    if corner.uv is not None and surface.footprint is not None:
        # Within a texture the place is known to float32 steps of its whole side: wrapped, scaled and less half a texel.
        found["uv"] = planes.errors(corner.uv[place], 4 * U)
        if driver.texel:
            largest = max(1 / s.size.min() for s in draw.pictures)
            found["uv"] = found["uv"] + driver.texel * largest
        found["level"] = _levels(draw, fragments, surface, planes.size, driver)
    if corner.colour is not None:
        found["colour"] = planes.errors(corner.colour[place], 0.0)
    return _Errors(**found)


def _vertex_errors(draw: Draw, surface: Surface, which: NDArray[np.intp], driver: Driver) -> _Errors:
    """Of attributes made in the vertex stage."""
    matrix = np.abs(draw.world_from_object)
    world = np.abs(draw.instance.mesh.positions[which]) @ matrix[:3, :3].T + matrix[:3, 3]
    unit = np.full(surface.normal.shape, UNIT) if draw.lamps else None
    return _Errors(
        position=driver.window * U * world if _places_matter(draw) else None,
        normal=unit,
        tangent=unit if surface.tangent is not None else None,
    )


def _places_matter(draw: Draw) -> bool:
    return any("position" in lamp.values for lamp in draw.lamps) or (bool(draw.lamps) and draw.viewer is None)


def _per_pixel(draw: Draw, fragments: Fragments, size: tuple[int, int], planes: _Planes, driver: Driver) -> dict[str, Array]:
    surface = surface_at(draw, fragments, size, AT_CENTRE)
    side = np.where(fragments.front | (not draw.instance.back_faces), 1.0, -1.0)
    surface = replace(surface, side=side)
    return _spread(draw, shown, surface, _errors(draw, fragments, surface, planes, driver))


def _per_vertex(draw: Draw, fragments: Fragments, size: tuple[int, int], planes: _Planes) -> dict[str, Array]:
    corners = draw.triangles[fragments.triangle]
    x, y = places(fragments, size, AT_CENTRE)
    weight = weights(draw, fragments.triangle, x, y, size, derivatives=False).values
    result: dict[str, Array] = {}
    back = ~fragments.front & draw.instance.back_faces
    interpolation = np.zeros((len(fragments), 3))
    for side in (1.0, -1.0):
        which = np.flatnonzero(back == (side < 0))
        if not len(which):
            continue
        vertices, place = np.unique(corners[which], return_inverse=True)
        place = place.reshape(-1, 3)
        surface = replace(at_vertices(draw, vertices, np.float64), side=np.full(len(vertices), side))
        found = _spread(draw, shown, surface, _vertex_errors(draw, surface, vertices, planes.driver))
        for name, values in found.items():
            by = weight[which] if name == "value" else np.abs(weight[which])
            result.setdefault(name, np.zeros((len(fragments), 3)))[which] = blend(by, values[place])
        # Triangles of which only the other side is seen get planes of no meaning, which nobody asks for.
        table = np.zeros((len(draw.instance.mesh.positions), 3))
        table[vertices] = found["value"]
        interpolation[which] = planes.errors(table[planes.corners], 0.0)[which]
    result["below"], result["above"] = result["below"] + interpolation, result["above"] + interpolation
    return result


def _per_face(draw: Draw, fragments: Fragments, driver: Driver) -> dict[str, Array]:
    faces, place = np.unique(fragments.triangle, return_inverse=True)
    vertices = draw.triangles[faces, 2]
    surface = at_vertices(draw, vertices, np.float64, centroids=True)

    def seen(draw: Draw, surface: Surface, material: Any = None) -> Array:
        if draw.instance.back_faces:
            facing = np.einsum("ij,ij->i", surface.normal, toward_viewer(draw, surface.position)) >= 0
            surface = replace(surface, side=np.where(facing, 1.0, -1.0).astype(surface.normal.dtype))
        return shown(draw, surface, material)

    found = _spread(draw, seen, surface, _vertex_errors(draw, surface, vertices, driver))
    return {name: values[place] for name, values in found.items()}


def _spread(draw: Draw, evaluate: Callable[..., Array], surface: Surface, errors: _Errors) -> dict[str, Array]:
    """The fields of Bounds (but alpha): the model at the surface, at the surface disturbed, and in float32."""
    material = material_of(draw, surface)
    value = evaluate(draw, surface, material)
    below, above = np.zeros_like(value), np.zeros_like(value)
    rounding = np.abs(evaluate(draw, _narrow(surface)) - value)

    def reaches(there: list[Array]) -> None:
        np.add(below, np.maximum(value - np.minimum.reduce(there), 0), out=below)
        np.add(above, np.maximum(np.maximum.reduce(there) - value, 0), out=above)

    if errors.normal is not None:
        # All corners of the box: a lobe that is cut off at a horizon is seen on both sides of it, whichever way it lies.
        there = []
        for number, signs in enumerate(product((-1.0, 1.0), repeat=3)):
            turned = replace(surface, normal=surface.normal + np.array(signs) * errors.normal)
            there.append(evaluate(draw, turned, material))
            if number in (1, 6):
                rounding = np.maximum(rounding, np.abs(evaluate(draw, _narrow(turned)) - there[-1]))
        low, high = np.minimum.reduce(there), np.maximum.reduce(there)
        # Where opposite corners are not about as far to either side, a peak or a horizon lies within.
        bend = np.maximum.reduce([np.abs(there[k] + there[7 - k] - 2 * value) for k in range(4)])
        wide = np.flatnonzero((bend > BENT * (high - low) + FLUSHED).any(axis=1))
        if len(wide):
            some, error = _some(surface, wide), errors.normal[wide]
            for signs in product((1.0,), (-1.0, 1.0), (-1.0, 1.0)):
                shifts = _spaced(-error, error, LEVELS)
                along = [evaluate(draw, replace(some, normal=some.normal + np.array(signs) * shift)) for shift in shifts]
                margin = _between(along)
                low[wide] = np.minimum(low[wide], np.minimum.reduce(along) - margin)
                high[wide] = np.maximum(high[wide], np.maximum.reduce(along) + margin)
        reaches([low, high])
    for name in ("position", "tangent"):
        error = getattr(errors, name)
        for axis in range(0 if error is None else error.shape[1]):
            moves = [_moved(surface, name, axis, sign * error[:, axis]) for sign in (-1.0, 1.0)]
            reaches([evaluate(draw, moved, material) for moved in moves])
    for axis, error in enumerate([] if errors.uv is None else errors.uv.T):
        # Textures are read anew, and have kinks wherever one texel hands over to the next.
        shifts = _spaced(-error, error, SHIFTS)
        there = [evaluate(draw, _moved(surface, "uv", axis, shift)) for shift in shifts]
        margin = _between(there)
        reaches([*(other - margin for other in there), *(other + margin for other in there)])
    if errors.colour is not None and surface.colour is not None:
        reaches([evaluate(draw, replace(surface, colour=surface.colour + sign * errors.colour)) for sign in (-1, 1)])
    level = np.zeros_like(value)
    if errors.level is not None:
        there = [evaluate(draw, replace(surface, level=offset)) for offset in _spaced(*errors.level, LEVELS)]
        margin = _between(there)
        reaches([*(other - margin for other in there), *(other + margin for other in there)])
        level = np.maximum.reduce([np.abs(other - value) for other in there]) + margin
    return {
        **{"value": value, "below": below, "above": above, "level": level},
        **{"rounding": rounding, "magnitude": np.abs(value)},
    }


def _alphas(draw: Draw, surface: Surface, errors: _Errors, driver: Driver) -> Array:
    """(3, N): alpha, and the least and most it may be."""
    value = alpha_of(draw, surface)
    there = [value]
    if draw.alpha_sampler is not None and errors.uv is not None:
        for axis in (0, 1):
            shifts = _spaced(-errors.uv[:, axis], errors.uv[:, axis], SHIFTS)
            several = [alpha_of(draw, _moved(surface, "uv", axis, shift)) for shift in shifts]
            margin = _between(several)
            there += [np.minimum.reduce(several) - margin, np.maximum.reduce(several) + margin]
        if errors.level is not None:
            several = [alpha_of(draw, replace(surface, level=offset)) for offset in _spaced(*errors.level, LEVELS)]
            margin = _between(several)
            there += [np.minimum.reduce(several) - margin, np.maximum.reduce(several) + margin]
    slack: Array = 8 * U * np.abs(value)
    if errors.colour is not None and surface.colour is not None:
        there += [alpha_of(draw, replace(surface, colour=surface.colour + sign * errors.colour)) for sign in (-1, 1)]
    low = value - sum(np.maximum(value - other, 0) for other in there) - slack
    high = value + sum(np.maximum(other - value, 0) for other in there) + slack
    return np.stack([value, low, high])


def _levels(
    draw: Draw, fragments: Fragments, surface: Surface, size: tuple[int, int], driver: Driver
) -> tuple[Array, Array] | None:
    """(least, most), each (N,), of what a driver's level of detail may differ by; None where no texture is made smaller.

    A driver may take differences within a square of 2 x 2 pixels (OpenGL 4.6 core, 8.14.1; GLSL 4.60, 8.14.1) where the
    formula has derivatives.
    """
    assert surface.footprint is not None
    samplers = draw.pictures
    exact = [sampler.level(*surface.footprint) for sampler in samplers]
    if max(level.max(initial=-np.inf) for level in exact) < -1:
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
    least, most = np.zeros(len(x)), np.zeros(len(x))
    for sampler, level in zip(samplers, exact, strict=True):
        for i, j in product((0, 1), repeat=2):
            other = sampler.level(uv[1, j] - uv[0, j], uv[i, 1] - uv[i, 0]) - level
            least, most = np.minimum(least, other), np.maximum(most, other)
    return least - driver.level, most + driver.level


def _some(surface: Surface, which: NDArray[np.intp]) -> Surface:
    """The surface at some of its points."""

    def take(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(take, value))
        return value[which] if isinstance(value, np.ndarray) else value

    return replace(surface, **{f.name: take(getattr(surface, f.name)) for f in fields(surface)})


def _moved(surface: Surface, name: str, axis: int, by: Array) -> Surface:
    values = getattr(surface, name).copy()
    values[:, axis] += by
    return replace(surface, **{name: values})


def _spaced(low: Array, high: Array, count: int) -> list[Array]:
    """`count` numbers from low to high (N,)."""
    return [low + (high - low) * (k / (count - 1)) for k in range(count)]


def _between(samples: list[Array]) -> Array:
    """How far a function may reach past the largest of its evenly spaced samples: half its largest second difference, which
    is what a kink halfway between two of them makes (one mip level handing over to the next); a parabola makes a quarter."""
    s = np.stack(samples)
    bend: Array = np.abs(s[2:] - 2 * s[1:-1] + s[:-2]).max(axis=0)
    return bend / 2


def _narrow(surface: Surface) -> Surface:
    """The same in float32."""

    def narrow(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(narrow, value))
        return value.astype(np.float32) if isinstance(value, np.ndarray) else value

    return replace(surface, **{f.name: narrow(getattr(surface, f.name)) for f in fields(surface)})
