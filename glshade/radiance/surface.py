"""Surface: points of an instance's surface, and the light that they show to the viewer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import unit_and_length
from glshade.lights import FALLOFFS
from glshade.radiance.draw import Draw, Lamp
from glshade.radiance.joined_draw import JoinedDraw
from glshade.radiance.sampler import Sampler

Array = NDArray[Any]

# The least cosine between the normal and the direction to the viewer. A direction with a smaller cosine is mirrored upward, as
# in shaders/surface/horizon.glsl.
HORIZON = 1e-3
# A vector of a direction map counts as no direction if its length is at most this, as in shaders/surface/direction_map.glsl.
NO_DIRECTION = 0.01


@dataclass(frozen=True, eq=False)
class Surface:
    """N points of a surface, in world space relative to the eye.

    side: 1, or -1 where the normal has to be reversed (N,).
    position: positions (N, 3) [scene units].
    normal: normals as they were interpolated, of any length (N, 3).
    tangent: tangents, and in the last column the sign of the bitangent (N, 4); None where they are not needed.
    uv: texture coordinates (N, 2); None for a mesh without them.
    colour: vertex colours, linear Rec. 709, and alpha (N, 4); None where they are not used.
    footprint: changes of uv from a pixel to the next one in its row and in its column, (N, 2) each; None in the vertex stage.
    level: number, or array (N,), that is added to the textures' level of detail.
    grid: the `Sampler.grid` of the textures to whose level of detail it is added; None for all textures.
    member: the index (N,) of each point's draw in a joined draw; None for the points of a single draw.
    """

    side: Array
    position: Array
    normal: Array
    tangent: Array | None
    uv: Array | None
    colour: Array | None
    footprint: tuple[Array, Array] | None = None
    level: Any = 0.0
    grid: tuple[Any, ...] | None = None
    member: NDArray[np.intp] | None = None

    def level_of(self, sampler: Sampler) -> Array:
        """Returns the level of detail (N,) of a texture at the points of a fragment stage."""
        assert self.footprint is not None
        level = sampler.level(*self.footprint)
        return level + self.level if self.grid is None or self.grid == sampler.grid else level


def mapped(surface: Surface, function: Callable[[Array], Array]) -> Surface:
    """Returns the surface with a function applied to all arrays that have a row for each point."""

    def apply(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(apply, value))
        return function(value) if isinstance(value, np.ndarray) and value.ndim else value

    return replace(surface, **{name: apply(value) for name, value in vars(surface).items()})


def by_columns(surface: Surface) -> Surface:
    """Returns the surface with arrays whose columns are contiguous: NumPy computes with these in a third of the time."""
    return mapped(surface, np.asfortranarray)


def part_of(surface: Surface, which: slice | NDArray[np.intp]) -> Surface:
    """Returns some points of a surface."""
    return mapped(surface, lambda value: value[which])


def joined(surfaces: Sequence[Surface]) -> Surface:
    """Returns the points of several surfaces, which have the same attributes and the same `grid`, as one surface."""

    def join(values: list[Any]) -> Any:
        if isinstance(values[0], tuple):
            return tuple(join(list(parts)) for parts in zip(*values, strict=True))
        return None if values[0] is None else np.concatenate(values)

    counts = [len(surface.position) for surface in surfaces]
    levels = [np.broadcast_to(surface.level, count) for surface, count in zip(surfaces, counts, strict=True)]
    rows = [name for name in vars(surfaces[0]) if name not in ("level", "grid")]
    named = {name: join([getattr(surface, name) for surface in surfaces]) for name in rows}
    return Surface(**named, level=np.concatenate(levels), grid=surfaces[0].grid)


def at_vertices(draw: Draw, which: NDArray[np.intp], dtype: Any, centroids: bool = False) -> Surface:
    """Returns the surface at vertices.

    which: indices of the vertices (N,).
    dtype: NumPy type of the result.
    centroids: whether the points are the centroids of faces, which are stored with the vertices of faceted meshes.
    """
    if isinstance(draw, JoinedDraw):
        return part_of(_at_members(draw, dtype, centroids), which)
    mesh = draw.instance.mesh
    place = mesh.centroids if centroids and mesh.centroids is not None else mesh.positions
    linear = draw.world_from_object[:3, :3].astype(dtype)
    position = place[which].astype(dtype) @ linear.T + draw.world_from_object[:3, 3].astype(dtype)
    if mesh.normals is None:
        normal = np.zeros_like(position)
    else:
        normal = _unit(mesh.normals[which].astype(dtype) @ draw.normal_from_object.astype(dtype).T)
    tangent = None
    if draw.tangents and mesh.tangents is not None:
        along = mesh.tangents[which].astype(dtype)
        turned = _unit(along[:, :3] @ linear.T)
        # A transform that mirrors turns right-handed frames into left-handed ones.
        hand = -along[:, 3:] if draw.instance.mirrored else along[:, 3:]
        tangent = np.concatenate([turned, hand], axis=1)
    uvs, colours = (mesh.centroid_uvs, mesh.centroid_colours) if centroids else (mesh.uvs, mesh.colours)
    uv = None if uvs is None else uvs[which].astype(dtype)
    colour = colours[which].astype(dtype) if draw.instance.vertex_colours and colours is not None else None
    return Surface(np.ones(len(position), dtype=dtype), position, normal, tangent, uv, colour)


def _at_members(draw: JoinedDraw, dtype: Any, centroids: bool) -> Surface:
    """Returns the surface at all vertices of a joined draw. dtype, centroids: as for `at_vertices`."""
    key = dtype, centroids
    if key not in draw.kept:
        corners = draw.corners
        ends = np.searchsorted(corners.member, np.arange(len(corners.members) + 1))
        parts = [
            at_vertices(member, corners.vertex[ends[k] : ends[k + 1]], dtype, centroids)
            for k, member in enumerate(corners.members)
        ]
        draw.kept[key] = replace(joined(parts), level=0.0, member=corners.member)
    found: Surface = draw.kept[key]
    return found


def _own(value: Any, surface: Surface, columns: tuple[int, ...] = ()) -> Array:
    """Returns a value of a draw in the surface's number type; for a joined draw with a row for each member, that of each point.

    columns: the shape of the value of one draw.
    """
    values = np.asarray(value)
    if values.ndim > len(columns):
        assert surface.member is not None
        values = values[surface.member]
    return values.astype(surface.position.dtype)


def _sampled(sampler: Sampler, surface: Surface) -> Array:
    """Returns the values (N, 4) of a texture at the points."""
    if surface.uv is None:
        raise ValueError("a texture needs texture coordinates")
    if surface.footprint is None:
        return sampler.sample(sampler.coordinates(surface.uv))
    return sampler.sample(sampler.coordinates(surface.uv), surface.level_of(sampler))


def alpha_of(draw: Draw, surface: Surface) -> Array:
    """Returns the alpha of the points (N,)."""
    value = np.full(len(surface.position), _own(draw.alpha, surface))
    if draw.alpha_sampler is not None:
        value = value * _sampled(draw.alpha_sampler, surface)[:, 3]
    if surface.colour is not None:
        value = value * surface.colour[:, 3]
    return value


def material_of(draw: Draw, surface: Surface) -> SimpleNamespace:
    """Returns the material at the points: colours (N, 3) or (3,), numbers (N,) or ().

    Beside the model's parameters it has `emission`, the light that the points emit, and `openness`, the factor of ambient
    light.
    """
    values: dict[str, Array] = {"emission": _emission(draw, surface), "openness": _openness(draw, surface)}
    for name, declared in draw.model.parameters().items():
        colour = draw.model.is_colour(name)
        shape = (3,) if colour else ()
        value = _own(draw.parameters[name], surface, shape)
        if name in draw.samplers:
            texel = _sampled(draw.samplers[name], surface)
            value = value * (texel[:, :3] if colour else texel[:, draw.channels[name]]) + _own(draw.added[name], surface, shape)
            # A texel outside of the parameter's range is clamped to it.
            value = np.clip(value, value.dtype.type(declared.low), declared.high and value.dtype.type(declared.high))
        # Vertex colours multiply the base colour, and a parameter that equals the base colour because it was left out.
        tinted = declared.base or _stands_for_base(draw, name)
        if tinted and surface.colour is not None:
            value = value * surface.colour[:, :3]
        values[name] = value
    return SimpleNamespace(**values, **draw.instance.material.chosen(), **draw.data)


def repeated(draw: Draw, material: SimpleNamespace, count: int) -> SimpleNamespace:
    """Returns a material of `material_of` for points that are repeated, all of them `count` times."""
    columns = {name: 1 if draw.model.is_colour(name) else 0 for name in draw.model.parameters()}
    values = dict(vars(material))
    for name, own in {**columns, "emission": 1, "openness": 1}.items():
        if values[name].ndim > own:
            values[name] = np.concatenate([values[name]] * count)
    return SimpleNamespace(**values)


def _emission(draw: Draw, surface: Surface) -> Array:
    """Returns the light, (3,) or (N, 3), that the points emit. Texels below 0 count as 0."""
    emission = _own(draw.emission, surface, (3,))
    if "emission" not in draw.samplers:
        return emission
    texel = _sampled(draw.samplers["emission"], surface)[:, :3]
    result: Array = np.maximum(emission * texel + _own(draw.added["emission"], surface, (3,)), 0)
    return result


def _openness(draw: Draw, surface: Surface) -> Array:
    """Returns the factor, (1,) or (N, 1), by which the occlusion map multiplies ambient light at the points."""
    dtype = surface.position.dtype
    if "occlusion" not in draw.samplers:
        return np.ones(1, dtype=dtype)
    texel = _sampled(draw.samplers["occlusion"], surface)[:, draw.channels["occlusion"], None]
    result: Array = 1 + _own(draw.occlusion, surface)[..., None] * (np.clip(texel, 0, 1) - 1)
    return result


def _stands_for_base(draw: Draw, name: str) -> bool:
    """Returns whether a parameter was left out and takes the value of the base colour."""
    declared = draw.model.parameters()
    same_as = declared[name].same_as
    return same_as is not None and declared[same_as].base and getattr(draw.instance.material, name) is None


def _frame(draw: Draw, surface: Surface) -> tuple[Array, Array, Array]:
    """Returns the shading frame (t, b, n), (N, 3) each: unit, perpendicular, and with n on the side that is seen."""
    n = _unit(surface.normal)
    side = surface.side[:, None]
    if surface.tangent is None:
        return (*_any_tangents(side * n), side * n)
    t = _unit(_without(surface.tangent[:, :3], n))
    b = np.cross(n, t) * surface.tangent[:, 3:]
    n = side * n
    if draw.normal_map is not None:
        x, y, z = (2 * _sampled(draw.normal_map, surface)[:, :3] - 1).T[..., None]
        n = _unit(_own(draw.normal_scale, surface)[..., None] * (x * t + y * b) + z * n)
        t = _unit(_without(t, n))
        b = _unit(_without(_without(b, n), t))
    if draw.directions is not None:
        d = 2 * _sampled(draw.directions, surface)[:, :2] - 1
        along = np.array([1.0, 0.0], dtype=d.dtype)
        t, b = _turned(t, b, _unit(np.where(np.linalg.norm(d, axis=1, keepdims=True) > NO_DIRECTION, d, along)))
    return (*_turned(t, b, np.atleast_2d(_own(draw.turn, surface, (2,)))), n)


def _turned(t: Array, b: Array, direction: Array) -> tuple[Array, Array]:
    """Returns t and b (N, 3) turned about their normal.

    direction: cosine and sine of the angles from t toward b, (N, 2) or (1, 2).
    """
    cos, sin = direction[:, :1], direction[:, 1:]
    return cos * t + sin * b, cos * b - sin * t


def toward_viewer(draw: Draw, position: Array) -> Array:
    """Returns the unit directions v (N, 3) to the viewer, from positions (N, 3) relative to the eye."""
    if draw.viewer is None:
        return _unit(-position)
    return np.broadcast_to(draw.viewer.astype(position.dtype), position.shape)


def evaluate_surface(draw: Draw, surface: Surface, material: SimpleNamespace | None = None) -> Array:
    """Returns the light (N, 3) that the points show to the viewer, linear Rec. 709, or the property that the instance shows.

    material: optional, the result of `material_of` for the same points, where it is known already.
    """
    if draw.text is not None:
        return draw.text(surface)
    if draw.instance.shows != "light":
        return _property(draw, surface)
    if draw.shares:
        return np.asarray(sum(evaluate_surface(share, surface) for share in draw.shares))
    light = _light(draw, surface, material)
    return light if draw.weights is None else light @ draw.weights.T.astype(light.dtype)


def added_light(draw: Draw, surface: Surface) -> Array:
    """Returns the sum (N, 3) of the absolute values of the terms that make up the light of a draw with shares; 0 for others.

    The bands of a spectrum add negative light, so that the sum can be much larger than the light itself.
    """
    total = np.zeros((len(surface.position), 3), dtype=surface.position.dtype)
    for share in draw.shares if draw.text is None else ():
        light = np.abs(_light(share, surface, None))
        total += light if share.weights is None else light @ np.abs(share.weights).T.astype(light.dtype)
    return total


def _light(draw: Draw, surface: Surface, material: SimpleNamespace | None) -> Array:
    """Returns the light (N, 3) that the points show to the viewer, before bands of wavelengths become RGB.

    material: as for `evaluate_surface`.
    """
    dtype = surface.position.dtype
    surface = by_columns(surface)
    m = material or material_of(draw, surface)
    total: Array = np.zeros((3, len(surface.position)), dtype=dtype).T + m.emission
    if draw.ambient.any():
        total += m.openness * _own(draw.ambient, surface, (3,)) * draw.model.ambient_reflectance(m)
    if not (draw.lamps or draw.surrounds):
        return total
    t, b, n = _frame(draw, surface)
    for lamp in draw.surrounds:
        total += m.openness * lamp.kind.illuminate(lamp.fields(dtype), n) * draw.model.ambient_reflectance(m)
    if not draw.lamps:
        return total

    def local(direction: Array) -> Array:
        return _columns(*(_dot(axis, direction) for axis in (t, b, n)))

    v = toward_viewer(draw, surface.position)
    # A visible point faces the viewer, but its interpolated normal may not. So v is mirrored above the horizon.
    up = 2 * np.maximum(HORIZON - _dot(n, v), 0)[:, None]
    v = (v + up * n) / np.sqrt(1 + 2 * HORIZON * up)
    v_local = local(v)
    for lamp in draw.lamps:
        l, e = _arriving(lamp, surface.position)
        total += e * draw.model.brdf_cos(m, local(l), v_local)
    return total


def light_at(draw: Draw, surface: Surface) -> Array:
    """Returns the light (N, 3) that arrives at the points, as absolute values summed over all lights.

    Light that depends on the normal is counted for that direction of the six axes where it is brightest.
    """
    position = surface.position
    total = np.broadcast_to(np.abs(_own(draw.ambient, surface, (3,))), position.shape).copy()
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    for lamp in draw.surrounds:
        total += np.abs(lamp.kind.illuminate(lamp.fields(np.float64), axes)).max(axis=0)
    for lamp in draw.lamps:
        total += np.abs(_arriving(lamp, position)[1])
    return total


def _arriving(lamp: Lamp, position: Array) -> tuple[Array, Array]:
    """Returns (l, e), (N, 3) each: the unit directions to a light, and its light perpendicular to them, at positions (N, 3)."""
    light = lamp.fields(position.dtype)
    l, e = lamp.kind.illuminate(light, position)
    if lamp.falloff != "none":
        r = np.maximum(np.linalg.norm(light.position - position, axis=1), light.r_min)
        e = e / (r ** FALLOFFS[lamp.falloff].power)[:, None]
    return l, e


def _property(draw: Draw, surface: Surface) -> Array:
    """Returns the property (N, 3) that the instance shows in place of light: its normal, uv, or depth and number."""
    if draw.instance.shows == "normal":
        return _frame(draw, surface)[2]
    result = np.zeros_like(surface.position)
    if draw.instance.shows == "uv":
        result[:, :2] = surface.uv
    else:
        forward = draw.clip_from_world[3, :3] if draw.viewer is None else -draw.viewer
        result[:, 0], result[:, 1] = surface.position @ forward, draw.instance.number
    return result


def _unit(x: Array) -> Array:
    """Returns the vectors x (..., 3), of any leading shape, made unit; the zero vector stays as it is."""
    return unit_and_length(x)[0]


def _columns(*columns: Array) -> Array:
    """Returns the array (N, C) of C columns (N,), which stay contiguous."""
    return np.stack(columns).T


def _dot(a: Array, b: Array) -> Array:
    """Returns the dot products (N,) of vectors (N, 3)."""
    result: Array = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]
    return result


def _without(x: Array, n: Array) -> Array:
    """Returns the vectors x (N, 3) without their components along n (N, 3)."""
    result: Array = x - n * _dot(n, x)[:, None]
    return result


def _any_tangents(n: Array) -> tuple[Array, Array]:
    """Returns some t and b (N, 3) perpendicular to the unit normals n (N, 3), for isotropic models.

    Source: Duff et al. 2017, listing 3.
    """
    x, y, z = n.T
    sign = np.copysign(np.ones_like(z), z)
    a = -1 / (sign + z)
    c = x * y * a
    return _columns(1 + sign * x * x * a, sign * c, -sign * x), _columns(c, sign + y * y * a, -y)
