"""Shapes: the meshes of the primitives, and a reader of simple OBJ files."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from support.third.textures import decoded
from support.third.vectors import Array, single, unit

# Positions or normals (N, 3) of a surface, from its coordinates u and v (N,).
Surface = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Mesh:
    """Triangles without shared vertices: an attribute has one row for each corner of each triangle.

    positions: positions of the corners (T, 3, 3), in object space.
    normals: unit normals (T, 3, 3); None where the mesh has none.
    uvs: texture coordinates (T, 3, 2); None where the mesh has none.
    colours: vertex colours (T, 3, 3), linear Rec. 709; None where the mesh has none.
    tangents: tangents and the sign of the bitangent (T, 3, 4); None where they were not asked for.
    """

    positions: Array
    normals: Array | None = None
    uvs: Array | None = None
    colours: Array | None = None
    tangents: Array | None = None


def mesh_of(item: Mapping[str, Any]) -> Mesh:
    """Returns the mesh of an object of a scene. Its numbers are rounded to float32."""
    if "mesh" in item:
        return obj(Path(item["mesh"]))
    shape = {"type": item["shape"]} if isinstance(item["shape"], str) else dict(item["shape"])
    parts = _SHAPES[shape.pop("type")](**shape)
    positions, normals, uvs = (None if a[0] is None else single(np.concatenate(a)) for a in zip(*parts, strict=True))
    assert positions is not None
    return Mesh(positions, normals, uvs)


Part = tuple[Array, Array, Array | None]


def _swept(columns: int, rows: int, position: Surface, normal: Surface, poles: tuple[bool, bool] = (False, False)) -> Part:
    """Returns positions, normals and uvs (T, 3, .) of a surface that is cut in columns x rows quads along u and v.

    The diagonal of each quad leads from its corner with the least u and v to the one with the greatest.
    poles: whether the row at v = 0 and the row at v = 1 are single points. A triangle there has its middle u at the pole.
    """
    x, y = (a.reshape(-1) for a in np.meshgrid(np.arange(columns), np.arange(rows)))
    quad = [np.stack([x + i, y + j], axis=1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    one, other = np.stack(quad[:3], axis=1), np.stack([quad[0], quad[2], quad[3]], axis=1)
    # One triangle of a quad at a pole has two corners there, and no area.
    if poles[0]:
        one = one[y > 0]
    if poles[1]:
        other = other[y < rows - 1]
    corners = np.concatenate([one, other]).astype(np.float64)
    middle = corners[..., 0].copy()
    for pole, row in zip(poles, (0, rows), strict=True):
        if pole:
            at = corners[..., 1] == row
            middle[at] = np.repeat((corners[..., 0].min(axis=1) + 0.5)[:, None], 3, axis=1)[at]
    u, v = middle / columns, corners[..., 1] / rows
    flat_u, flat_v = u.reshape(-1), v.reshape(-1)
    places = [surface(flat_u, flat_v).reshape(-1, 3, 3) for surface in (position, normal)]
    return places[0], places[1], np.stack([u, v], axis=-1)


def _circle(u: Array) -> Array:
    """Returns the unit directions (N, 3) at the longitudes u (N,): counter-clockwise seen from above, from -z."""
    # The longitude 1 is 0 again, so that both have the same bytes and the surface closes.
    angle = 2 * math.pi * np.where(u == 1, 0, u)
    return np.stack([-np.sin(angle), np.zeros_like(u), -np.cos(angle)], axis=1)


def _up(y: Array | float, count: int) -> Array:
    """Returns the vectors (0, y, 0) (count, 3)."""
    result = np.zeros((count, 3))
    result[:, 1] = y
    return result


def _sphere(segments: int = 96, rings: int = 48) -> list[Part]:
    def position(u: Array, v: Array) -> Array:
        latitude = math.pi * (v - 0.5)
        radius = np.where((v == 0) | (v == 1), 0.0, np.cos(latitude))
        return radius[:, None] * _circle(u) + _up(np.sin(latitude), len(u))

    return [_swept(segments, rings, position, position, (True, True))]


def _torus(minor: float = 0.4, segments: int = 96, sides: int = 48) -> list[Part]:
    def tube(v: Array) -> tuple[Array, Array]:
        angle = 2 * math.pi * np.where(v == 1, 0, v) + math.pi
        return np.cos(angle), np.sin(angle)

    def position(u: Array, v: Array) -> Array:
        c, s = tube(v)
        return (1 + minor * c)[:, None] * _circle(u) + _up(minor * s, len(u))

    def normal(u: Array, v: Array) -> Array:
        c, s = tube(v)
        return c[:, None] * _circle(u) + _up(s, len(u))

    return [_swept(segments, sides, position, normal)]


def _plane(segments: int = 1) -> list[Part]:
    def position(u: Array, v: Array) -> Array:
        return np.stack([2 * u - 1, np.zeros_like(u), 1 - 2 * v], axis=1)

    return [_swept(segments, segments, position, lambda u, v: _up(1.0, len(u)))]


def _side(n: Array, up: Array) -> Part:
    """Returns the side of a cube with the normal n (3,), whose texture stands upright along `up` (3,)."""

    def position(u: Array, v: Array) -> Array:
        return n + (2 * u - 1)[:, None] * np.cross(up, n) + (2 * v - 1)[:, None] * up

    return _swept(1, 1, position, lambda u, v: np.tile(n, (len(u), 1)))


def _cube() -> list[Part]:
    x, y, z = np.eye(3)
    walls = [_side(n, y) for n in (x, -x, z, -z)]
    return [*walls, _side(y, -z), _side(-y, z)]


def _cap(segments: int, y: float) -> Part:
    """Returns a disc of radius 1 at height y that faces up if y is positive, else down."""
    i = np.arange(segments)
    first, second = (_circle(np.where(k == segments, 0, k) / segments) for k in (i, i + 1))
    rim = (first, second) if y > 0 else (second, first)
    corners = np.stack([np.zeros((segments, 3)), *rim], axis=1)
    uvs = np.stack([corners[..., 0], -y * corners[..., 2]], axis=-1) / 2 + 0.5
    return corners + np.array([0.0, y, 0.0]), np.tile([0.0, y, 0.0], (segments, 3, 1)), uvs


def _cylinder(segments: int = 64) -> list[Part]:
    wall = _swept(segments, 1, lambda u, v: _circle(u) + _up(2 * v - 1, len(u)), lambda u, v: _circle(u))
    return [wall, _cap(segments, -1.0), _cap(segments, 1.0)]


def _cone(segments: int = 64) -> list[Part]:
    def position(u: Array, v: Array) -> Array:
        return (1 - v)[:, None] * _circle(u) + _up(2 * v - 1, len(u))

    def normal(u: Array, v: Array) -> Array:
        return (2 * _circle(u) + _up(1.0, len(u))) / math.sqrt(5)

    return [_swept(segments, 1, position, normal, (False, True)), _cap(segments, -1.0)]


def _icosphere(subdivisions: int = 4) -> list[Part]:
    g = (1 + math.sqrt(5)) / 2
    # The twelve corners are (0, +-1, +-g) and its cyclic exchanges. Any three at the distance 2 from each other are a triangle.
    corners = np.array([np.roll([0, a, b * g], k) for k in range(3) for a in (-1, 1) for b in (-1, 1)])
    near = np.abs(np.linalg.norm(corners[:, None] - corners, axis=2) - 2) < 1e-9
    faces = [
        (i, j, k)
        for i, j, k in np.ndindex(12, 12, 12)
        if i < min(j, k) and near[i, j] and near[j, k] and near[k, i] and np.linalg.det(corners[[i, j, k]]) > 0
    ]
    p = unit(corners[np.array(faces)])
    for _ in range(subdivisions):
        a, b, c = p.transpose(1, 0, 2)
        ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
        p = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return [(p, p, None)]


_SHAPES: dict[str, Callable[..., list[Part]]] = {
    "sphere": _sphere,
    "icosphere": _icosphere,
    "cube": _cube,
    "plane": _plane,
    "torus": _torus,
    "cylinder": _cylinder,
    "cone": _cone,
}


def obj(path: Path) -> Mesh:
    """Returns the mesh of an OBJ file of triangles, whose corners all have the same form. Vertices may have colours."""
    rows: dict[str, list[list[float]]] = {"v": [], "vt": [], "vn": []}
    faces = []
    for line in path.read_text(encoding="utf-8").splitlines():
        word, *rest = line.split()
        if word == "f":
            faces.append([[int(part or 0) - 1 for part in (corner + "//").split("/")[:3]] for corner in rest])
        elif word in rows:
            rows[word].append([float(number) for number in rest])
    corner = np.array(faces)
    v, vt, vn = (np.array(rows[key]) for key in ("v", "vt", "vn"))
    return Mesh(
        single(v[corner[..., 0], :3]),
        single(unit(vn[corner[..., 2]])) if len(vn) else None,
        single(vt[corner[..., 1], :2]) if len(vt) else None,
        single(decoded(v[corner[..., 0], 3:])) if v.shape[1] == 6 else None,
    )
