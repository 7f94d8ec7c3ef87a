"""Surface: points of an instance, and the light that they show to the viewer."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.sampler import Sampler

Array = NDArray[Any]

# As in the shaders: how far above the horizon of n lies the plane at which the viewer is mirrored.
HORIZON = 1e-3


# ... and how long the direction of a map has to be.
NO_DIRECTION = 0.01


@dataclass(frozen=True, eq=False)
class Surface:
    """Points of a surface, in world space relative to the eye.

    position, normal (N, 3), tangent (N, 4), uv (N, 2), colour (N, 4). The normal as interpolated, of any length. side (N,): -1
    turns the normal over. footprint: change of uv from pixel to pixel, across and down; None in the vertex stage. level: added
    to the textures' level of detail, a number or (N,).
    """

    side: Array
    position: Array
    normal: Array
    tangent: Array | None
    uv: Array | None
    colour: Array | None
    footprint: tuple[Array, Array] | None = None
    level: Any = 0.0


def at_vertices(draw: Draw, which: NDArray[np.intp], dtype: Any, centroids: bool = False) -> Surface:
    """The surface at vertices, or at the centroids that they carry."""
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
        # A mirror turns right-handed frames into left-handed ones.
        hand = -along[:, 3:] if draw.instance.mirrored else along[:, 3:]
        tangent = np.concatenate([turned, hand], axis=1)
    uvs, colours = (mesh.centroid_uvs, mesh.centroid_colours) if centroids else (mesh.uvs, mesh.colours)
    uv = None if uvs is None else uvs[which].astype(dtype)
    colour = colours[which].astype(dtype) if draw.instance.vertex_colours and colours is not None else None
    return Surface(np.ones(len(position), dtype=dtype), position, normal, tangent, uv, colour)


def _sampled(sampler: Sampler, surface: Surface) -> Array:
    if surface.uv is None:
        raise ValueError("a texture needs texture coordinates")
    if surface.footprint is None:
        return sampler.sample(surface.uv)
    return sampler.sample(surface.uv, sampler.level(*surface.footprint) + surface.level)


def alpha_of(draw: Draw, surface: Surface) -> Array:
    value = np.full(len(surface.position), draw.alpha, dtype=surface.position.dtype)
    if draw.alpha_sampler is not None:
        value = value * _sampled(draw.alpha_sampler, surface)[:, 3]
    if surface.colour is not None:
        value = value * surface.colour[:, 3]
    return value


def material_of(draw: Draw, surface: Surface) -> SimpleNamespace:
    """The model's parameters at the points: colours (N, 3) or (3,), scalars (N,) or ()."""
    found: dict[str, Array] = {}
    for name, declared in draw.model.parameters().items():
        value = draw.parameters[name].astype(surface.position.dtype)
        colour = draw.model.is_colour(name)
        if name in draw.samplers:
            texel = _sampled(draw.samplers[name], surface)
            value = value * (texel[:, :3] if colour else texel[:, draw.channels[name]])
            # A texel beyond what a parameter may be counts as the nearest that it may.
            value = np.clip(value, value.dtype.type(declared.low), declared.high and value.dtype.type(declared.high))
        # A parameter that equals the surface's own colour equals it with its vertex colours.
        tinted = declared.base or _stands_for_base(draw, name)
        if tinted and surface.colour is not None:
            value = value * surface.colour[:, :3]
        found[name] = value
    return SimpleNamespace(**found, **draw.instance.material.chosen())


def _stands_for_base(draw: Draw, name: str) -> bool:
    declared = draw.model.parameters()
    same_as = declared[name].same_as
    return same_as is not None and declared[same_as].base and getattr(draw.instance.material, name) is None


def _frame(draw: Draw, surface: Surface) -> tuple[Array, Array, Array]:
    """(t, b, n), each (N, 3): unit and perpendicular, n on the side that is seen."""
    n = _unit(surface.normal)
    side = surface.side[:, None]
    if surface.tangent is None:
        return (*_any_tangents(side * n), side * n)
    t = _unit(_without(surface.tangent[:, :3], n))
    b = np.cross(n, t) * surface.tangent[:, 3:]
    n = side * n
    if draw.normal_map is not None:
        x, y, z = (2 * _sampled(draw.normal_map, surface)[:, :3] - 1).T[..., None]
        n = _unit(draw.normal_scale * (x * t + y * b) + z * n)
        t = _unit(_without(t, n))
        b = _unit(_without(_without(b, n), t))
    if draw.directions is not None:
        d = 2 * _sampled(draw.directions, surface)[:, :2] - 1
        along = np.array([1.0, 0.0], dtype=d.dtype)
        t, b = _turned(t, b, _unit(np.where(np.linalg.norm(d, axis=1, keepdims=True) > NO_DIRECTION, d, along)))
    return (*_turned(t, b, draw.turn.astype(t.dtype)[None]), n)


def _turned(t: Array, b: Array, direction: Array) -> tuple[Array, Array]:
    """t, b (N, 3) turned about their normal; direction (N or 1, 2): cos and sin, from t toward b."""
    cos, sin = direction[:, :1], direction[:, 1:]
    return cos * t + sin * b, cos * b - sin * t


def toward_viewer(draw: Draw, position: Array) -> Array:
    """v (N, 3)."""
    if draw.viewer is None:
        return _unit(-position)
    return np.broadcast_to(draw.viewer.astype(position.dtype), position.shape)


def shown(draw: Draw, surface: Surface, material: SimpleNamespace | None = None) -> Array:
    """(N, 3): the sum over the lights of what the points show to the viewer. material: `material_of` them, if at hand."""
    dtype = surface.position.dtype
    if draw.instance.shows != "light":
        return _place(draw, surface)
    m = material or material_of(draw, surface)
    total = np.zeros((len(surface.position), 3), dtype=dtype)
    if draw.ambient.any():
        total += draw.ambient.astype(dtype) * draw.model.ambient_reflectance(m)
    if not draw.lamps:
        return total
    t, b, n = _frame(draw, surface)

    def local(direction: Array) -> Array:
        return np.stack([np.einsum("ij,ij->i", axis, direction) for axis in (t, b, n)], axis=1)

    v = toward_viewer(draw, surface.position)
    # A pixel that is seen faces the viewer, whatever an average of its neighbours' normals says.
    up = 2 * np.maximum(HORIZON - np.einsum("ij,ij->i", n, v), 0)[:, None]
    v = (v + up * n) / np.sqrt(1 + 2 * HORIZON * up)
    v_local = local(v)
    for lamp in draw.lamps:
        light = lamp.fields(dtype)
        l, e = lamp.kind.illuminate(light, surface.position)
        if lamp.falloff != "none":
            r = np.maximum(np.linalg.norm(light.position - surface.position, axis=1), light.r_min)
            e = e / (r if lamp.falloff == "1/r" else r * r)[:, None]
        total += e * draw.model.brdf_cos(m, local(l), v_local)
    return total


def _place(draw: Draw, surface: Surface) -> Array:
    """(N, 3): what an instance shows in place of light."""
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
    """x (..., 3) made unit; the zero vector stays."""
    largest = np.abs(x).max(axis=-1, keepdims=True)
    scaled = x / np.where(largest > 0, largest, 1)
    length = np.linalg.norm(scaled, axis=-1, keepdims=True)
    result: Array = scaled / np.where(length > 0, length, 1)
    return result


def _without(x: Array, n: Array) -> Array:
    """x (N, 3) less its part along n."""
    result: Array = x - n * np.einsum("ij,ij->i", n, x)[:, None]
    return result


def _any_tangents(n: Array) -> tuple[Array, Array]:
    """t, b (N, 3) perpendicular to the unit n (N, 3): Duff et al. 2017, listing 3. For models that are alike all round."""
    x, y, z = n.T
    sign = np.copysign(np.ones_like(z), z)
    a = -1 / (sign + z)
    c = x * y * a
    return np.stack([1 + sign * x * x * a, sign * c, -sign * x], axis=1), np.stack([c, sign + y * y * a, -y], axis=1)
