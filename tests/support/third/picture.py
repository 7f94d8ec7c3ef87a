"""Picture: casts a ray through the centre of each pixel, and computes the light of the surface that it meets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from support.third import lights, textures
from support.third.camera import View, view_of
from support.third.models import MODELS, Model, Place
from support.third.shapes import Mesh, mesh_of
from support.third.surfaces import face_normals, is_closed, with_normals, with_tangents
from support.third.vectors import Array, across, dot, single, unit

# A ray counts as near an edge within this distance [pixels].
EDGE = 1 / 50
# Two surfaces count as equally far if their depths differ by this share.
TIE = 1e-6
# Where the normal turns away from the viewer, the direction to the viewer is mirrored at this cosine.
HORIZON = 1e-3
# The number of triangles that rays are cast at together.
CHUNK = 256
# The material of an object that has none.
GREY = {"brdf": "phong", "kd": 0.6, "ks": 0.25, "exponent": 50.0}


@dataclass(frozen=True)
class Trace:
    """A traced picture.

    pixels: the light (H, W, 3), linear Rec. 709. Row 0 is the top row.
    sure: whether a pixel (H, W) can be compared: no edge passes near its centre, no two surfaces are equally far there, and
        its textures are not minified.
    """

    pixels: Array
    sure: NDArray[np.bool_]


@dataclass(frozen=True)
class Points:
    """N points of an object's surface.

    p: positions (N, 3), in world space [scene units].
    n: normals (N, 3), in world space, of any length.
    side: 1, or -1 where the back of the surface is seen (N, 1).
    tangent: tangents and the sign of the bitangent (N, 4); None without tangents.
    uv: texture coordinates (N, 2); None without them.
    colour: vertex colours (N, 3); None without them.
    """

    p: Array
    n: Array
    side: Array
    tangent: Array | None
    uv: Array | None
    colour: Array | None


class Thing:
    """An object of the scene, with its mesh in world space."""

    def __init__(self, scene: Mapping[str, Any], item: Mapping[str, Any]) -> None:
        self.item = item
        material = item.get("material", GREY)
        self.material: Mapping[str, Any] = scene["materials"][material] if isinstance(material, str) else material
        self.rate = item.get("shading", "phong")
        self.to_world = world_of(scene, item)
        linear = self.to_world[:3, :3]
        # A transform that mirrors turns the triangles inside out.
        self.hand = math.copysign(1.0, np.linalg.det(linear))
        self.to_normal = np.linalg.inv(linear).T
        raw = mesh_of(item)
        self.both = self._both(raw)
        self.mesh = with_normals(raw, item.get("normals", "auto"), item.get("threshold", 40.0))
        if self.model.anisotropic or self.maps:
            self.mesh = with_tangents(self.mesh)
        self.corners = self.mesh.positions @ linear.T + self.to_world[:3, 3]

    @property
    def model(self) -> Model:
        return MODELS[self.material["brdf"]]

    @property
    def maps(self) -> list[Mapping[str, Any]]:
        return [self.material[key] for key in ("normal_map", "bump_map") if key in self.material]

    @property
    def pictures(self) -> list[Mapping[str, Any]]:
        """All textures of the material."""
        return [value for value in self.material.values() if isinstance(value, Mapping)]

    def _both(self, mesh: Mesh) -> bool:
        """Returns whether back faces are drawn."""
        sides = self.item.get("sides", "auto")
        sides = self.material.get("sides", "auto") if sides == "auto" else sides
        return sides == "both" or (sides == "auto" and not is_closed(mesh))

    def at_corners(self, triangles: Array, side: Array) -> Points:
        """Returns the corners of triangles (M,) as 3 M points. side: 1 or -1 (M,)."""

        def rows(values: Array | None) -> Array | None:
            return None if values is None else values[triangles].reshape(-1, values.shape[-1])

        tangent = rows(self.mesh.tangents)
        if tangent is not None:
            turned = unit(tangent[:, :3] @ self.to_world[:3, :3].T)
            tangent = np.concatenate([turned, tangent[:, 3:] * self.hand], axis=1)
        p, n = rows(self.corners), rows(self.mesh.normals)
        assert p is not None
        assert n is not None
        normal = unit(n @ self.to_normal.T)
        return Points(p, normal, np.repeat(side, 3)[:, None], tangent, rows(self.mesh.uvs), rows(self.coloured))

    @cached_property
    def coloured(self) -> Array | None:
        """The vertex colours (T, 3, 3) that multiply the base colour; None where the object does not use them."""
        return self.mesh.colours if self.item.get("vertex_colours", True) else None


def world_of(scene: Mapping[str, Any], item: Mapping[str, Any]) -> Array:
    """Returns the matrix (4, 4) from an object to world space, through all its parents."""
    world = _transform(item.get("transform", {}))
    if "parent" not in item:
        return world
    return world_of(scene, next(one for one in scene["objects"] if one.get("name") == item["parent"])) @ world


def _transform(keys: Mapping[str, Any]) -> Array:
    if "matrix" in keys:
        return np.array(keys["matrix"], dtype=np.float64)
    (cx, cy, cz), (sx, sy, sz) = (f(np.radians(keys.get("rotate", (0, 0, 0)))) for f in (np.cos, np.sin))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    result = np.eye(4)
    result[:3, :3] = about_z @ about_y @ about_x @ np.diag(np.broadcast_to(keys.get("scale", 1.0), 3))
    result[:3, 3] = keys.get("translate", (0, 0, 0))
    return result


@dataclass
class Hits:
    """The nearest surface of each of N rays.

    depth: its depth (N,); infinite where a ray meets nothing [scene units].
    thing: number of the object (N,).
    triangle: number of the triangle (N,).
    weights: shares (N, 3) of the triangle's corners in the point that is met.
    front: whether the front is seen (N,).
    near_edge: least depth (N,) of a triangle with an edge that passes near the ray; infinite without one [scene units].
    second: depth (N,) of the next surface behind the nearest one [scene units].
    """

    depth: Array
    thing: Array
    triangle: Array
    weights: Array
    front: Array
    near_edge: Array
    second: Array


def cast(view: View, things: Sequence[Thing], q: Array, pixel: float) -> Hits:
    """Casts the rays through the homogeneous places q (N, 3) of the picture.

    pixel: the height of a pixel, in the units of q.
    """
    n = len(q)

    def nowhere() -> Array:
        return np.full(n, np.inf)

    numbers = np.zeros((2, n), dtype=int)
    hits = Hits(nowhere(), numbers[0], numbers[1], np.zeros((n, 3)), np.zeros(n, dtype=bool), nowhere(), nowhere())
    for index, thing in enumerate(things):
        for first in range(0, len(thing.corners), CHUNK):
            met = _meet(view, thing, first, q, pixel)
            if met is not None:
                _keep_nearest(hits, met, index)
    return hits


@dataclass(frozen=True)
class Meetings:
    """Where N rays meet M triangles of one object.

    triangle: numbers of the triangles (M,).
    front: whether the front of each triangle is seen (M,).
    weights: shares (N, M, 3) of the corners in the point that is met.
    depth: depths (N, M); infinite where a ray does not meet a triangle [scene units].
    near_edge: least depth (N,) of a triangle with an edge that passes near the ray; infinite without one [scene units].
    """

    triangle: Array
    front: Array
    weights: Array
    depth: Array
    near_edge: Array


def _meet(view: View, thing: Thing, first: int, q: Array, pixel: float) -> Meetings | None:
    """Casts the rays at some triangles of an object, from the number `first` on; None if none of them is drawn."""
    corners, depths = view.projected(thing.corners[first : first + CHUNK])
    # A ray q = sum of s_i c_i meets a triangle with the corners c_i where all s_i are positive: s_i = q . (c_j x c_k) / det.
    planes = np.cross(np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1))
    det = dot(planes[:, 0], corners[:, 0])[:, 0]
    front = det * thing.hand > 0
    drawn = np.flatnonzero((np.abs(det) > 1e-15) & (front | thing.both))
    if not len(drawn):
        return None
    planes = planes[drawn] / det[drawn, None, None]
    s = np.einsum("nk,tik->nti", q, planes)
    distance = s / (np.linalg.norm(planes[..., :2], axis=2) * pixel)
    total = s.sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = s / total[..., None]
        depth = np.einsum("nti,ti->nt", weights, depths[drawn])
    seen = (total > 0) & (depth >= view.near) & (depth <= view.far)
    # Where the near or the far plane cuts a triangle, it has another edge.
    cut = _cut(view, planes, depths[drawn], q, pixel)
    near = (distance > -EDGE).all(axis=2) & ((seen & (distance < EDGE).any(axis=2)) | ((total > 0) & cut))
    inside = seen & (s >= 0).all(axis=2)
    near_edge = np.where(near, depth, np.inf).min(axis=1)
    return Meetings(first + drawn, front[drawn], weights, np.where(inside, depth, np.inf), near_edge)


def _cut(view: View, planes: Array, depths: Array, q: Array, pixel: float) -> NDArray[np.bool_]:
    """Returns whether rays (N,) pass near the lines at which the near and the far plane cut triangles (M,), as an array (N, M).

    planes: vectors (M, 3, 3) whose dot products with q are the shares of the corners.
    depths: depths (M, 3) of the corners [scene units].
    """
    # Over the picture, the depth is linear in an orthographic view, and its inverse in a perspective view.
    slope = planes.sum(axis=1) if view.perspective else np.einsum("ti,tik->tk", depths, planes)
    limits = [view.near, view.far]
    if view.perspective:
        limits = [1 / limit if limit > 0 else np.inf for limit in limits]
    reach = EDGE * pixel * np.linalg.norm(slope[:, :2], axis=1)
    return np.any([np.abs(q @ slope.T - limit) < reach for limit in limits], axis=0)


def _keep_nearest(hits: Hits, met: Meetings, index: int) -> None:
    """Updates the hits where an object is nearer than what was met before. index: number of the object."""
    best = met.depth.argmin(axis=1)
    nearer = np.flatnonzero(met.depth[np.arange(len(best)), best] < hits.depth)
    best = best[nearer]
    depths = np.sort(np.column_stack([met.depth, hits.depth, hits.second]), axis=1)
    hits.depth, hits.second = depths[:, 0], depths[:, 1]
    hits.near_edge = np.minimum(hits.near_edge, met.near_edge)
    hits.thing[nearer], hits.triangle[nearer] = index, met.triangle[best]
    hits.weights[nearer], hits.front[nearer] = met.weights[nearer, best], met.front[best]


def trace(scene: Mapping[str, Any]) -> Trace:
    """Returns the picture of a scene, with one ray for each pixel."""
    film = scene["film"]
    width, height = film["size"]
    view = view_of(scene["camera"], (width, height))
    things = [Thing(scene, item) for item in scene["objects"]]
    q, pixel = view.pixels((width, height)), 2 * view.half[1] / height
    hits = cast(view, things, q, pixel)
    pixels = np.tile(np.broadcast_to(np.asarray(film.get("background", 0.0), dtype=np.float64), (3,)), (len(q), 1))
    behind = hits.depth + TIE * np.abs(hits.depth)
    sure = (np.isinf(hits.near_edge) | (hits.near_edge > behind)) & (np.isinf(hits.second) | (hits.second > behind))
    for index, thing in enumerate(things):
        met = np.flatnonzero((hits.thing == index) & np.isfinite(hits.depth))
        if len(met):
            side = np.where(hits.front[met] | (not thing.both), 1.0, -1.0)
            pixels[met] = _seen(scene, thing, view, hits.triangle[met], hits.weights[met], side)
            sure[met] &= ~_minified(thing, view, hits.triangle[met], q[met], pixel)
    x, y, w, h = film.get("crop", (0, 0, width, height))
    window = (slice(y, y + h), slice(x, x + w))
    return Trace(pixels.reshape(height, width, 3)[window], sure.reshape(height, width)[window])


def _mean(corners: Array, weights: Array) -> Array:
    """Returns the means (N, .) of the values at corners (3 N, .), weighted by (N, 3)."""
    return np.einsum("nk,nkc->nc", weights, corners.reshape(len(weights), 3, -1))


def _seen(scene: Mapping[str, Any], thing: Thing, view: View, triangle: Array, weights: Array, side: Array) -> Array:
    """Returns the light (N, 3) that points of an object show, by the object's rate of shading."""
    corners = thing.at_corners(triangle, side)
    if thing.rate == "gouraud":
        return _mean(light_of(scene, thing, view, corners), weights)

    def between(values: Array | None, by: Array = weights) -> Any:
        return None if values is None else _mean(values, by)

    if thing.rate == "phong":
        inside = {key: between(getattr(corners, key)) for key in ("p", "n", "tangent", "uv", "colour")}
        return light_of(scene, thing, view, Points(side=side[:, None], **inside))
    return light_of(scene, thing, view, _centroids(thing, view, corners, triangle, between))


def _centroids(thing: Thing, view: View, corners: Points, triangle: Array, between: Any) -> Points:
    """Returns the centroids of triangles, with the normals of the faces. Where both sides are drawn, they face the viewer."""
    third = np.full((len(triangle), 3), 1 / 3)
    middle = single(thing.mesh.positions[triangle].mean(axis=1))
    p = middle @ thing.to_world[:3, :3].T + thing.to_world[:3, 3]
    n = unit(single(face_normals(thing.mesh)[triangle]) @ thing.to_normal.T)
    away = thing.both & (dot(n, view.toward_viewer(p)) < 0)
    tangent = None
    if thing.mesh.tangents is not None:
        tangent = _flat_tangents(thing, triangle)
    uv, colour = between(corners.uv, third), between(corners.colour, third)
    return Points(p, n, np.where(away, -1.0, 1.0), tangent, uv, colour)


def _flat_tangents(thing: Thing, triangle: Array) -> Array:
    """Returns the tangents (N, 4) of faces: the mean of their corners' tangents, made perpendicular to the face's normal."""
    tangents = thing.mesh.tangents
    assert tangents is not None
    flat = single(unit(across(tangents[triangle, :, :3].mean(axis=1), face_normals(thing.mesh)[triangle])))
    turned = unit(flat @ thing.to_world[:3, :3].T)
    return np.concatenate([turned, tangents[triangle, 0, 3:] * thing.hand], axis=1)


def _minified(thing: Thing, view: View, triangle: Array, q: Array, pixel: float) -> NDArray[np.bool_]:
    """Returns whether a step of one pixel leads over more than one texel of a texture (N,)."""
    result = np.zeros(len(q), dtype=bool)
    if not thing.pictures or thing.rate != "phong":
        return result
    uv = thing.mesh.uvs
    assert uv is not None
    corners, _ = view.projected(thing.corners[triangle])
    planes = np.cross(np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1))

    def at(places: Array) -> Array:
        s = np.einsum("nk,nik->ni", places, planes)
        return np.einsum("ni,nic->nc", s / s.sum(axis=1, keepdims=True), uv[triangle])

    for step in np.eye(3)[:2] * pixel:
        change = np.abs(at(q + 1e-3 * step) - at(q - 1e-3 * step)) / 2e-3
        for texture in thing.pictures:
            result |= np.linalg.norm(change * textures.size_of(texture), axis=1) > 0.99
    return result


def light_of(scene: Mapping[str, Any], thing: Thing, view: View, points: Points) -> Array:
    """Returns the light (N, 3) that points show to the viewer, linear Rec. 709."""
    m = parameters(thing, points)
    exposure = 2.0 ** scene["film"].get("exposure", 0.0)
    if thing.material.get("unlit"):
        return (emission(thing, points) + (m[thing.model.base] if thing.model.base else thing.model.ambient(m))) * exposure
    n, t, b = _frame(thing, points)
    v = view.toward_viewer(points.p)
    lift = 2 * np.maximum(HORIZON - dot(n, v), 0)
    v = unit(v + lift * n)
    total, openness = emission(thing, points), _openness(thing, points)
    for light in scene["lights"]:
        if "only" in light and thing.item.get("name") not in light["only"]:
            continue
        if light["type"] == "ambient":
            total += lights.intensity(light) * thing.model.ambient(m) * openness
            continue
        l, strength = lights.reaching(light, points.p)
        lit = np.flatnonzero((dot(n, l) > 0)[:, 0] & (dot(n, v) > 0)[:, 0])
        place = Place(n[lit], t[lit], b[lit], l[lit], v[lit])
        part = {name: value[lit] for name, value in m.items()}
        total[lit] += math.pi * strength[lit] * thing.model.f_cos(part, place)
    return total * exposure


def emission(thing: Thing, points: Points) -> Array:
    """Returns the light (N, 3) that points emit, before the exposure."""
    given = thing.material.get("emission", 0.0)
    if isinstance(given, Mapping):
        assert points.uv is not None
        return np.maximum(textures.coloured(given, points.uv), 0.0)
    return np.array(np.broadcast_to(np.asarray(given, dtype=np.float64), points.p.shape))


def _openness(thing: Thing, points: Points) -> Array | float:
    """Returns the factor of ambient light at points (N, 1)."""
    given = thing.material.get("occlusion")
    if given is None:
        return 1.0
    assert points.uv is not None
    return 1.0 - given.get("strength", 1.0) * (1.0 - textures.numbered(given, points.uv))


def parameters(thing: Thing, points: Points) -> dict[str, Array]:
    """Returns the model's parameters at points: colours (N, 3) and numbers (N, 1)."""
    model, count = thing.model, len(points.p)

    def value(name: str, kinds: Mapping[str, Any], columns: int) -> Array:
        default, low, high = kinds[name]
        given = thing.material.get(name, default)
        if isinstance(given, str):
            return value(given, kinds, columns)
        if not isinstance(given, Mapping):
            result = np.array(np.broadcast_to(np.asarray(given, dtype=np.float64), (count, columns)))
        else:
            assert points.uv is not None
            read = textures.coloured if columns == 3 else textures.numbered
            result = np.clip(read(given, points.uv), low, high)
        return result * points.colour if points.colour is not None and name == model.base else result

    colours = {name: value(name, model.colours, 3) for name in model.colours}
    return colours | {name: value(name, model.numbers, 1) for name in model.numbers}


def _frame(thing: Thing, points: Points) -> tuple[Array, Array, Array]:
    """Returns the normal, the tangent and the bitangent (N, 3) at points, with the normal on the side that is seen."""
    n = unit(points.n)
    if points.tangent is None:
        t = unit(np.cross(n, np.eye(3)[np.abs(n).argmin(axis=1)]))
        return points.side * n, t, np.cross(n, t)
    t = unit(across(points.tangent[:, :3], n))
    b = np.cross(n, t) * points.tangent[:, 3:]
    n = points.side * n
    for key, read in (("normal_map", textures.mapped_normal), ("bump_map", textures.bumped_normal)):
        if key in thing.material:
            assert points.uv is not None
            x, y, z = read(thing.material[key], points.uv).T[..., None]
            n = unit(x * t + y * b + z * n)
            t = unit(across(t, n))
            b = unit(across(across(b, n), t))
    angle = math.radians(thing.material.get("tangent_direction", 0.0))
    return n, math.cos(angle) * t + math.sin(angle) * b, math.cos(angle) * b - math.sin(angle) * t
