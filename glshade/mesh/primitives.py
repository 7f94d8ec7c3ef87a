"""Primitives: meshes that are computed from formulas: sphere, icosphere, cube, plane, torus, cylinder and cone.

All have unit size, triangles that are counter-clockwise seen from outside, and exact normals. All but the icosphere have uvs.
Where a surface closes on itself its vertices are doubled, so that u runs from 0 to 1 without a jump.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glshade.arrays import Array, Float64
from glshade.mesh.mesh import Mesh
from glshade.mesh.order import ordered


def sphere(segments: int = 64, rings: int = 32) -> Mesh:
    """Returns a sphere with radius 1 about the origin, whose poles lie on +-y.

    segments: the number of divisions of longitude, at least 3.
    rings: the number of divisions of latitude, at least 2.

    u is the longitude. It runs counter-clockwise seen from +y and starts at -z, so that +z is the middle of the picture. v is
    the latitude, from south to north. Errors: ValueError.
    """
    _at_least("sphere", segments=(segments, 3), rings=(rings, 2))
    latitude = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    radius, height = np.cos(latitude), np.sin(latitude)
    radius[[0, -1]] = 0.0  # cos(pi/2) is 6e-17 in float64, which would make a ring of the pole
    normals, uvs, triangles = _revolve(radius, height, radius, latitude / np.pi + 0.5, segments)
    positions = normals.copy()
    return _mesh(positions, triangles, normals, uvs)


def icosphere(subdivisions: int = 4) -> Mesh:
    """Returns a sphere with radius 1 about the origin: an icosahedron whose triangles are split in four `subdivisions` times.

    It has 20 * 4**subdivisions triangles of nearly equal size. It has no uvs, because any seam would cut through triangles.
    Errors: ValueError.
    """
    _at_least("icosphere", subdivisions=(subdivisions, 0))
    g = (1 + np.sqrt(5)) / 2
    p = np.array([
        [-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g],
        [0, -1, -g], [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1],
    ])  # fmt: skip
    t = np.array([
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
        [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
    ])  # fmt: skip
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    sides = np.sort(np.stack([t, np.roll(t, -1, axis=1)], axis=2), axis=2)  # (T, 3, 2): ab, bc, ca
    ends, edge = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    # The edges are numbered along with the triangles. To find them again in each round would take longer than all the rest.
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
    """Returns a cube from -1 to 1 with sharp edges and 24 vertices. The uvs of each side cover the whole unit square."""
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
    """Returns the square y = 0 from -1 to 1 in x and z, facing +y, cut in `segments` x `segments` quads.

    u runs along x and v along -z. Errors: ValueError.
    """
    _at_least("plane", segments=(segments, 1))
    s = np.linspace(0.0, 1.0, segments + 1)
    v, u = (a.reshape(-1) for a in np.meshgrid(s, s, indexing="ij"))
    positions = np.stack([2 * u - 1, np.zeros_like(u), 1 - 2 * v], axis=1)
    normals = np.tile([0.0, 1.0, 0.0], (len(u), 1))
    return _mesh(positions, _grid(segments, segments), normals, np.stack([u, v], axis=1))


def torus(segments: int = 96, sides: int = 48, minor: float = 0.4) -> Mesh:
    """Returns a torus about the y axis; the middle of its tube is a circle with radius 1.

    segments: the number of divisions round the axis, at least 3.
    sides: the number of divisions round the tube, at least 3.
    minor: the radius of the tube, 0 < minor <= 1.

    u runs round the axis. v runs round the tube; it starts at the inner side and goes downward first. Errors: ValueError.
    """
    _at_least("torus", segments=(segments, 3), sides=(sides, 3))
    if not 0 < minor <= 1:
        raise ValueError(f"torus: minor must lie in (0, 1], not {minor}")
    angle = np.linspace(0.0, 2 * np.pi, sides + 1) + np.pi
    c, s = np.cos(angle), np.sin(angle)
    c[-1], s[-1] = c[0], s[0]  # the last ring lies exactly on the first
    v = np.linspace(0.0, 1.0, sides + 1)
    normals, uvs, triangles = _revolve(c, s, 1 + minor * c, v, segments)
    direction = _circle(segments)
    ring = (1 + minor * c)[:, None, None] * direction
    ring[..., 1] += (minor * s)[:, None]
    return _mesh(ring.reshape(-1, 3), triangles, normals, uvs)


def cylinder(segments: int = 64) -> Mesh:
    """Returns a cylinder with caps about the y axis, with radius 1, from y = -1 to y = 1. Its rims are sharp.

    segments: the number of divisions round the axis, at least 3.

    On the wall u is the longitude and v the height; on the caps the uvs form a disc. Errors: ValueError.
    """
    _at_least("cylinder", segments=(segments, 3))
    return _capped(np.array([1.0, 1.0]), np.array([1.0, 1.0]), np.array([0.0, 0.0]), (-1, 1), segments)


def cone(segments: int = 64) -> Mesh:
    """Returns a cone with a cap about the y axis, with radius 1 at y = -1 and its apex at y = 1. Its rim is sharp.

    segments: the number of divisions round the axis, at least 3.

    On the wall u is the longitude and v the height; on the cap the uvs form a disc. The apex has no normal, so each triangle
    has a vertex of its own there, with the normal of the triangle's middle. Errors: ValueError.
    """
    _at_least("cone", segments=(segments, 3))
    slope = 1 / np.sqrt(5)  # the wall falls by 2 over a radius of 1
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
    """Checks counts, each given as (value, least allowed value). Errors: ValueError."""
    for name, (value, least) in counts.items():
        if value < least:
            raise ValueError(f"{shape}: {name} must be at least {least}, not {value}")


def _mesh(positions: Float64, triangles: Array, normals: Float64, uvs: Float64 | None) -> Mesh:
    """Returns the mesh with these arrays, without the vertices that no triangle uses, in an order that suits caches."""
    used = np.zeros(len(positions), dtype=bool)
    used[triangles] = True
    if not used.all():  # a pole has one vertex for each segment, which is one fewer than its ring has columns
        triangles = (np.cumsum(used) - 1)[triangles]
        positions, normals, uvs = positions[used], normals[used], None if uvs is None else uvs[used]
    return ordered(Mesh.build(positions, triangles, normals, uvs))


def _circle(segments: int, offset: float = 0.0) -> Float64:
    """Returns (segments + 1, 3) unit directions round the y axis, counter-clockwise from -z. The last equals the first exactly.

    offset: the angle of the first direction, in segments.
    """
    angle = (np.arange(segments + 1) + offset) * (2 * np.pi / segments)
    circle = np.stack([-np.sin(angle), np.zeros_like(angle), -np.cos(angle)], axis=1)
    circle[-1] = circle[0]
    return circle


def _grid(columns: int, rows: int) -> Array:
    """Returns (2 rows columns, 3) triangles of a grid of (rows + 1) x (columns + 1) vertices, which are numbered row by row."""
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1)
    b, c, d = a + 1, a + columns + 2, a + columns + 1
    return np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)


def _revolve(across: Float64, up: Float64, radius: Float64, v: Float64, segments: int) -> tuple[Float64, Float64, Array]:
    """Returns normals (V, 3), uvs (V, 2) and triangles (T, 3) of the surface that a profile sweeps as it turns round the y
    axis.

    The profile has P points. The outside lies to the right of someone who goes along it.
    across: (P,) the component of the normal away from the axis.
    up: (P,) the component of the normal along the axis.
    radius: (P,) the distance from the axis. Where it is 0 the point is a pole: each triangle has a vertex of its own there,
        with u at the middle of the triangle, and the triangles without area are left out.
    v: (P,) the second texture coordinate.
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
            # The remaining triangle (a, c, d) has the pole at a, which is the vertex of its own column already.
        else:
            keep[pole - 1, :, 1] = False
            # The remaining triangle (a, b, c) has the pole at c, which is the vertex of the next column.
            triangles[pole - 1, :, 0, 2] -= 1
    uvs = np.stack([u, np.broadcast_to(v[:, None], u.shape)], axis=-1).reshape(-1, 2)
    return normals.reshape(-1, 3), uvs, triangles[keep]


def _capped(radius: Float64, across: Float64, up: Float64, caps: tuple[int, ...], segments: int) -> Mesh:
    """Returns a wall between y = -1 and y = 1, with caps.

    radius: (2,) the radii of the wall at y = -1 and y = 1.
    across, up: (2,) the components of the normals at y = -1 and y = 1, away from the axis and along it.
    caps: the values of y, -1 or 1, at which the wall has a cap.
    """
    circle = _circle(segments)
    height = np.array([-1.0, 1.0])
    normals, uvs, triangles = _revolve(across, up, radius, np.array([0.0, 1.0]), segments)
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
