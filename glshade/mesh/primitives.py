"""Shapes made by formula: sphere, icosphere, cube, plane, torus, cylinder, cone.

All are of unit size, wound counter-clockwise seen from outside, with analytic normals and, but for the icosphere,
uvs. Where a surface closes on itself its vertices are doubled, so that u runs from 0 to 1 without a jump.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glshade.mesh.mesh import Array, Float64, Mesh, ordered


def sphere(segments: int = 64, rings: int = 32) -> Mesh:
    """Sphere of radius 1 at the origin, with its poles on +-y.

    segments: divisions of longitude, >= 3; rings: divisions of latitude, >= 2.
    u is longitude, from -z counter-clockwise seen from +y, so that +z is the middle of the picture; v is latitude, from
    south to north.
    """
    _at_least("sphere", segments=(segments, 3), rings=(rings, 2))
    latitude = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    radius, height = np.cos(latitude), np.sin(latitude)
    radius[[0, -1]] = 0.0  # cos(pi/2) is 6e-17: the pole would be a ring
    normals, uvs, triangles = _revolve(radius, height, radius, height, latitude / np.pi + 0.5, segments)
    positions = normals.copy()
    return _mesh(positions, triangles, normals, uvs)


def icosphere(subdivisions: int = 4) -> Mesh:
    """Sphere of radius 1 at the origin from an icosahedron, each triangle split in four `subdivisions` times.

    20 * 4**subdivisions triangles of nearly equal size. It has no uvs: no seam would keep its triangles whole.
    """
    _at_least("icosphere", subdivisions=(subdivisions, 0))
    g = (1 + np.sqrt(5)) / 2
    p = np.array(
        [
            *([-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g]),
            *([0, -1, -g], [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]),
        ]
    )
    t = np.array(
        [
            *([0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11]),
            *([1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8]),
            *([3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9]),
            *([4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]),
        ]
    )
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    sides = np.sort(np.stack([t, np.roll(t, -1, axis=1)], axis=2), axis=2)  # (T, 3, 2): ab, bc, ca
    ends, edge = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    # Edges are numbered along with the triangles: to find them again each time would take longer than all the rest.
    for _ in range(subdivisions):
        middle = p[ends[:, 0]] + p[ends[:, 1]]
        middle /= np.sqrt(np.square(middle).sum(axis=1, keepdims=True))
        (a, b, c), (ab, bc, ca) = t.T, len(p) + edge.T
        first = ends[:, 0][edge]
        # Edge e splits into 2e, at its first end, and 2e + 1.
        a_ab, b_bc, c_ca = 2 * edge.T + (t != first).T
        b_ab, c_bc, a_ca = 2 * edge.T + (t == first).T
        inner = 2 * len(ends) + np.arange(3 * len(t)).reshape(3, -1)
        at_a, at_b, at_c = inner
        new = len(p) + np.arange(len(ends))
        halves = np.stack([ends[:, 0], new, ends[:, 1], new], axis=1).reshape(-1, 2)
        across = [np.stack(x, axis=1) for x in ((ab, ca), (bc, ab), (ca, bc))]
        t = np.concatenate([np.stack(x, axis=1) for x in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
        four = ((a_ab, at_a, a_ca), (b_bc, at_b, b_ab), (c_ca, at_c, c_bc), (at_b, at_c, at_a))
        edge = np.concatenate([np.stack(x, axis=1) for x in four])
        ends = np.concatenate([halves, *across])
        p = np.concatenate([p, middle])
    return _mesh(p, t, p, None)


def cube() -> Mesh:
    """Cube from -1 to 1 with sharp edges: 24 vertices; each side carries the whole unit square of uvs."""
    corner = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    y = np.array([0.0, 1.0, 0.0])
    z = np.array([0.0, 0.0, 1.0])
    positions, normals = [], []
    for axis in range(3):
        for sign in (1.0, -1.0):
            n = np.zeros(3)
            n[axis] = sign
            up = -sign * z if axis == 1 else y  # v points up on the four walls
            positions.append(n + corner[:, :1] * np.cross(up, n) + corner[:, 1:] * up)
            normals.append(np.tile(n, (4, 1)))
    triangles = np.concatenate([4 * side + np.array([[0, 1, 2], [0, 2, 3]]) for side in range(6)])
    uvs = np.tile(corner / 2 + 0.5, (6, 1))
    return _mesh(np.concatenate(positions), triangles, np.concatenate(normals), uvs)


def plane(segments: int = 1) -> Mesh:
    """Square y = 0 from -1 to 1 in x and z, facing +y, of `segments` x `segments` quads; u along x, v along -z."""
    _at_least("plane", segments=(segments, 1))
    s = np.linspace(0.0, 1.0, segments + 1)
    v, u = (a.reshape(-1) for a in np.meshgrid(s, s, indexing="ij"))
    positions = np.stack([2 * u - 1, np.zeros_like(u), 1 - 2 * v], axis=1)
    normals = np.tile([0.0, 1.0, 0.0], (len(u), 1))
    return _mesh(positions, _grid(segments, segments), normals, np.stack([u, v], axis=1))


def torus(segments: int = 96, sides: int = 48, minor: float = 0.4) -> Mesh:
    """Torus about the y axis with major radius 1 and radius `minor` of the tube, 0 < minor <= 1.

    segments: divisions round the axis, >= 3; sides: divisions round the tube, >= 3. u runs round the axis, v round
    the tube from its inner side, first downward.
    """
    _at_least("torus", segments=(segments, 3), sides=(sides, 3))
    if not 0 < minor <= 1:
        raise ValueError(f"torus: minor must lie in (0, 1], not {minor}")
    angle = np.linspace(0.0, 2 * np.pi, sides + 1) + np.pi
    c, s = np.cos(angle), np.sin(angle)
    c[-1], s[-1] = c[0], s[0]  # the last ring lies exactly on the first
    v = np.linspace(0.0, 1.0, sides + 1)
    normals, uvs, triangles = _revolve(c, s, 1 + minor * c, s, v, segments)
    direction = _circle(segments)
    ring = (1 + minor * c)[:, None, None] * direction
    ring[..., 1] += (minor * s)[:, None]
    return _mesh(ring.reshape(-1, 3), triangles, normals, uvs)


def cylinder(segments: int = 64) -> Mesh:
    """Capped cylinder about the y axis, radius 1, y from -1 to 1; the rims are sharp.

    On the wall u is longitude and v height; the caps carry a disc of uvs.
    """
    _at_least("cylinder", segments=(segments, 3))
    return _capped(np.array([1.0, 1.0]), np.array([1.0, 1.0]), np.array([0.0, 0.0]), (-1, 1), segments)


def cone(segments: int = 64) -> Mesh:
    """Capped cone about the y axis, radius 1 at y = -1, its apex at y = 1; the rim is sharp.

    On the wall u is longitude and v height; the cap carries a disc of uvs. Each triangle has its own normal at the
    apex, that of its middle: the apex itself has none.
    """
    _at_least("cone", segments=(segments, 3))
    slope = 1 / np.sqrt(5)  # the wall falls 2 over a radius of 1
    across, up = np.array([2 * slope, 2 * slope]), np.array([slope, slope])
    return _capped(np.array([1.0, 0.0]), across, up, (-1,), segments)


PRIMITIVES: dict[str, Callable[..., Mesh]] = {
    "sphere": sphere,
    "icosphere": icosphere,
    "cube": cube,
    "plane": plane,
    "torus": torus,
    "cylinder": cylinder,
    "cone": cone,
}


def _at_least(shape: str, **counts: tuple[int, int]) -> None:
    for name, (value, least) in counts.items():
        if value < least:
            raise ValueError(f"{shape}: {name} must be at least {least}, not {value}")


def _mesh(positions: Float64, triangles: Array, normals: Float64, uvs: Float64 | None) -> Mesh:
    used = np.zeros(len(positions), dtype=bool)
    used[triangles] = True
    if not used.all():  # a pole has one copy fewer than its ring has columns
        triangles = (np.cumsum(used) - 1)[triangles]
        positions, normals, uvs = positions[used], normals[used], None if uvs is None else uvs[used]
    return ordered(Mesh.build(positions, triangles, normals, uvs))


def _circle(segments: int, offset: float = 0.0) -> Float64:
    """(segments + 1, 3) unit directions round the y axis, counter-clockwise from -z; the last is exactly the first."""
    angle = (np.arange(segments + 1) + offset) * (2 * np.pi / segments)
    circle = np.stack([-np.sin(angle), np.zeros_like(angle), -np.cos(angle)], axis=1)
    circle[-1] = circle[0]
    return circle


def _grid(columns: int, rows: int) -> Array:
    """(2 rows columns, 3) triangles over a grid of (rows + 1) x (columns + 1) vertices, the column running fastest."""
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1)
    b, c, d = a + 1, a + columns + 2, a + columns + 1
    return np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)


def _revolve(
    across: Float64, up: Float64, radius: Float64, height: Float64, v: Float64, segments: int
) -> tuple[Float64, Float64, Array]:
    """Normals, uvs and triangles of a profile turned round the y axis; its outside is to the right going up.

    across, up (P,): the normal's parts away from and along the axis. Where radius (P,) is 0 the point is a pole: each
    of its triangles has its own copy, with u at the triangle's middle, and the triangle without area is left out.
    """
    rings = len(v)
    normals = across[:, None, None] * _circle(segments)
    normals[..., 1] += up[:, None]
    u = np.tile(np.arange(segments + 1) / segments, (rings, 1))
    triangles = _grid(segments, rings - 1).reshape(rings - 1, segments, 2, 3)
    keep = np.ones(triangles.shape[:3], dtype=bool)
    for pole in np.flatnonzero(radius == 0):
        u[pole] += 0.5 / segments
        if pole == 0:
            keep[0, :, 0] = False
            # The remaining triangle (a, c, d) has the pole at its column's own vertex a already.
        else:
            keep[pole - 1, :, 1] = False
            # (a, b, c) has the pole at c, in the next column.
            triangles[pole - 1, :, 0, 2] -= 1
    uvs = np.stack([u, np.broadcast_to(v[:, None], u.shape)], axis=-1).reshape(-1, 2)
    return normals.reshape(-1, 3), uvs, triangles[keep]


def _capped(radius: Float64, across: Float64, up: Float64, caps: tuple[int, ...], segments: int) -> Mesh:
    """A wall between y = -1 and y = 1 with the given radii and normals there, and caps at the y in `caps`."""
    circle = _circle(segments)
    height = np.array([-1.0, 1.0])
    normals, uvs, triangles = _revolve(across, up, radius, height, np.array([0.0, 1.0]), segments)
    wall = radius[:, None, None] * circle
    wall[..., 1] += height[:, None]
    if radius[1] == 0:
        middle = across[1] * _circle(segments, 0.5)
        middle[:, 1] = up[1]
        normals[segments + 1 :] = middle
    all_positions, all_normals, all_uvs, all_triangles = [wall.reshape(-1, 3)], [normals], [uvs], [triangles]
    count = len(normals)
    for y in caps:
        rim = circle[:-1]
        here, there = np.arange(segments), (np.arange(segments) + 1) % segments
        disc = np.stack([np.full(segments, segments), here, there], axis=1)
        if y < 0:
            disc = disc[:, ::-1]
        all_positions.append(np.concatenate([rim, np.zeros((1, 3))]) + np.array([0.0, y, 0.0]))
        all_normals.append(np.tile([0.0, float(y), 0.0], (segments + 1, 1)))
        flat = np.stack([rim[:, 0], -y * rim[:, 2]], axis=1) / 2 + 0.5
        all_uvs.append(np.concatenate([flat, [[0.5, 0.5]]]))
        all_triangles.append(count + disc)
        count += segments + 1
    return _mesh(
        np.concatenate(all_positions),
        np.concatenate(all_triangles),
        np.concatenate(all_normals),
        np.concatenate(all_uvs),
    )
