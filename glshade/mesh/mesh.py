"""Triangle meshes: normals smoothed up to a threshold angle, tangents, and an order that suits caches.

Numpy only: importing scipy or trimesh here would cost every start of the program more than the work done.
Positions, normals and tangents are float32, because those bytes are what both renderers are given; every sum and
every angle on the way is taken in float64.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from glshade.errors import AssetError

Array: TypeAlias = npt.NDArray[Any]
Float32: TypeAlias = npt.NDArray[np.float32]
Float64: TypeAlias = npt.NDArray[np.float64]
UInt32: TypeAlias = npt.NDArray[np.uint32]
UInt64: TypeAlias = npt.NDArray[np.uint64]
Int64: TypeAlias = npt.NDArray[np.int64]

# The normal of a vertex whose triangles all have no area. No pixel shows it; a unit vector keeps what is evaluated
# there finite.
FALLBACK_NORMAL = (0.0, 0.0, 1.0)

# Added to a threshold, in degrees: float32 positions turn a face by about 1e-5 degrees, and the edge of a cube at a
# threshold of 90 must not depend on that.
THRESHOLD_SLACK = 1e-4

# Tangents either side of a uv seam are one where their sum is longer than this share of their lengths: 18 degrees apart.
AGREEING = 0.95

# |n x y| below which "across y" no longer gives a direction.
POLE = 1e-6

# Above this many triangles a mesh no longer fits the caches and its order begins to count.
ORDERED_ABOVE = 1000

_COLUMNS = {
    **{"normals": 3, "uvs": 2, "tangents": 4, "colours": 4},
    **{"centroids": 3, "centroid_uvs": 2, "centroid_colours": 4},
}


@dataclass(frozen=True, eq=False)
class Mesh:
    """An indexed triangle mesh; all arrays are contiguous and read-only.

    positions: (V, 3) float32, relative to `origin`.
    triangles: (T, 3) uint32, counter-clockwise seen from outside.
    normals: (V, 3) float32, unit.
    uvs: (V, 2) float32; v = 0 is the bottom of the picture.
    tangents: (V, 4) float32: t, unit and perpendicular to n, and w = +-1 with b = w cross(n, t).
    colours: (V, 4) float32, linear Rec. 709 with straight alpha.
    centroids (V, 3), centroid_uvs (V, 2), centroid_colours (V, 4): float32, of the triangle's corners the mean; only
    `faceted` sets them.
    origin: (3,) float64. Positions p_object = origin + positions: a mesh far from its origin keeps its shape.

    Raises AssetError for arrays whose shapes do not go together.
    """

    positions: Float32
    triangles: UInt32
    normals: Float32 | None = None
    uvs: Float32 | None = None
    tangents: Float32 | None = None
    colours: Float32 | None = None
    origin: Float64 = field(default_factory=lambda: np.zeros(3))
    centroids: Float32 | None = None
    centroid_uvs: Float32 | None = None
    centroid_colours: Float32 | None = None

    def __post_init__(self) -> None:
        def settle(name: str, dtype: type[Any], columns: int) -> None:
            array = np.array(getattr(self, name), dtype=dtype, order="C", copy=None)
            if array.ndim != 2 or array.shape[1] != columns:
                raise AssetError(f"mesh {name} have shape {array.shape}, not (n, {columns})")
            _freeze(self, name, array)

        settle("positions", np.float32, 3)
        settle("triangles", np.uint32, 3)
        for name, columns in _COLUMNS.items():
            if getattr(self, name) is not None:
                settle(name, np.float32, columns)
                if len(getattr(self, name)) != len(self.positions):
                    raise AssetError(f"mesh has {len(self.positions)} positions and {len(getattr(self, name))} {name}")
        if len(self.triangles) and int(self.triangles.max()) >= len(self.positions):
            raise AssetError(f"triangle index {self.triangles.max()} is out of range: {len(self.positions)} vertices")
        _freeze(self, "origin", np.array(self.origin, dtype=np.float64).reshape(3))

    @classmethod
    def build(
        cls,
        positions: npt.ArrayLike,
        triangles: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        colours: npt.ArrayLike | None = None,
    ) -> Mesh:
        """A Mesh from arrays nobody has checked yet.

        positions (V, 3), triangles (T, 3) integers, normals (V, 3) of any length, uvs (V, 2), colours (V, 4).
        Positions are made relative to the bounding box's centre where that centre is farther from 0 than the box is
        large; nearer, they keep their exact bytes. A normal that is zero or not finite is replaced by the smooth one.

        Raises AssetError: no triangle, a position that is not finite or too large, an index out of range.
        """
        p = _matrix(positions, 3, "positions")
        t = _indices(triangles, len(p))
        if not np.isfinite(p).all():
            bad = int(np.flatnonzero(~np.isfinite(p).all(axis=1))[0])
            raise AssetError(f"vertex {bad} (of {len(p)}, from 0) is not finite: {_row(p[bad])}")
        low, high = _box(p)
        centre = low / 2 + high / 2  # halves first: the sum of two large numbers may overflow
        with np.errstate(over="ignore"):
            far = np.linalg.norm(centre) > np.linalg.norm(high - low)
        origin = centre if far else np.zeros(3)
        p = p - origin
        if np.abs(p).max() > np.finfo(np.float32).max:
            raise AssetError(f"positions reach {np.abs(p).max():g}, too large for float32")

        def optional(array: npt.ArrayLike | None, columns: int, name: str) -> Float32 | None:
            if array is None:
                return None
            return _matrix(array, columns, name).astype(np.float32)

        mesh = cls(
            positions=p.astype(np.float32),
            triangles=t,
            uvs=optional(uvs, 2, "uvs"),
            colours=optional(colours, 4, "colours"),
            origin=origin,
        )
        for name in ("uvs", "colours"):
            given = getattr(mesh, name)
            if given is not None and not np.isfinite(given).all():
                raise AssetError(f"{name} hold values that are not finite")
        if normals is None:
            return mesh
        n, length = normalised(_matrix(normals, 3, "normals"))
        if len(n) != len(p):
            raise AssetError(f"mesh has {len(p)} positions and {len(n)} normals")
        lost = length == 0
        if lost.any():
            label = weld(mesh.positions)
            n[lost] = _smooth_by_label(mesh, label[mesh.triangles.reshape(-1)], int(label.max()) + 1)[label[lost]]
        return replace(mesh, normals=n.astype(np.float32))

    @cached_property
    def digest(self) -> str:
        """Hex sha256 of every array, its name and its shape."""
        h = hashlib.sha256()
        for f in fields(self):
            array = getattr(self, f.name)
            if array is not None:
                h.update(f"{f.name}{array.shape}".encode())
                h.update(array.data)
        return h.hexdigest()

    @cached_property
    def bounds(self) -> Float64:
        """(2, 3) least and greatest corner of the bounding box, origin included."""
        return np.stack(_box(self.positions)).astype(np.float64) + self.origin

    @cached_property
    def is_solid(self) -> bool:
        """Closed, consistently wound, and wound outward: back faces can then be culled unseen.

        Vertices at exactly equal positions count as one, and triangles with two such corners as none. Every directed
        edge must then occur once, its reverse once, and the signed volume must be positive.
        """
        place = weld(self.positions)
        a, b, c = (place[corner] for corner in self.triangles.astype(np.intp).T)
        flat = (a == b) | (b == c) | (c == a)
        if flat.any():
            a, b, c = a[~flat], b[~flat], c[~flat]
        tail, head = np.concatenate([a, b, c]), np.concatenate([b, c, a])
        edge = weld((np.minimum(tail, head) << 32 | np.maximum(tail, head))[:, None])
        # As many directions of edges as sides of triangles, and each of them there: then each is there once.
        sides = np.bincount(edge << 1 | (tail < head), minlength=1)
        if len(sides) != len(edge) or not sides.all():
            return False
        (x1, y1, z1), (x2, y2, z2), (x3, y3, z3) = _by_corner(self, self.positions.mean(axis=0, dtype=np.float64))
        terms = x1 * (y2 * z3 - z2 * y3) + y1 * (z2 * x3 - x2 * z3) + z1 * (x2 * y3 - y2 * x3)
        # A sheet folded onto itself is closed too; its volume is rounding.
        return bool(terms.sum() > 1e-12 * np.abs(terms).sum())

    @cached_property
    def is_local(self) -> bool:
        """Whether the mesh is in local order already: vertices numbered by first use, triangles along the curve."""
        corners = self.triangles.reshape(-1)
        if len(corners) == 0 or corners[0] != 0:
            return False
        highest = np.maximum.accumulate(corners)
        if highest[-1] + 1 != len(self.positions) or (corners[1:] > highest[:-1] + 1).any():
            return False
        place = _along_curve(self)
        return bool((place[1:] >= place[:-1]).all())


def face_normals(mesh: Mesh) -> Float64:
    """(T, 3) unit normals: the right-handed cross product of each triangle's edges (lecture slide 55).

    (0, 0, 0) for a triangle without area.
    """
    n = _area_vectors(mesh)
    with np.errstate(over="ignore"):
        length = np.sqrt(np.einsum("ij,ij->i", n, n))
    length[(length == 0) | ~np.isfinite(length)] = np.inf
    n /= length[:, None]
    return n


def with_normals(mesh: Mesh, kind: Literal["auto", "face", "smooth"], threshold: float) -> Mesh:
    """The mesh with a normal at every vertex; a vertex with several normals is split into as many.

    threshold [degrees].
    "face": no vertex is shared; each carries its triangle's normal (slide 56).
    "smooth": around a vertex, triangles joined by edges that bend by no more than `threshold` share one normal, the
        mean of theirs weighted by their angles at the vertex (Thuermer and Wuethrich 1998; slides 57-59). Vertices
        are taken together by position, so the normals agree across seams of uv and of colour. A triangle without
        area has no normal, and its edges bend by 90 degrees.
    "auto": the mesh's own normals where it has them, else "smooth".

    Vertices that no triangle uses are dropped, tangents too: they belong to the old normals.
    """
    if kind == "auto" and mesh.normals is not None:
        return mesh
    if kind == "face":
        n, length = normalised(_area_vectors(mesh))
        n[length == 0] = FALLBACK_NORMAL
        corners = mesh.triangles.reshape(-1)
        return _gather(mesh, corners, np.arange(len(corners)), normals=np.repeat(n, 3, axis=0))

    place = weld(mesh.positions)
    group, count = _fans(mesh, place, threshold)
    normals = _smooth_by_label(mesh, group, count)

    # Vertices that agree in everything but their number are one vertex: an STL file has three for each triangle.
    attributes = [a for a in (mesh.uvs, mesh.colours) if a is not None]
    vertex = weld(place[:, None], *attributes) if attributes else place
    corner_vertex = vertex[mesh.triangles.reshape(-1)]
    one = np.empty(count, dtype=np.int64)
    one[group] = corner_vertex
    if np.array_equal(one[group], corner_vertex):
        label, labels = group, count
    else:
        _, label = np.unique(group << 32 | corner_vertex, return_inverse=True)
        labels = int(label.max()) + 1
    source = np.empty(labels, dtype=np.int64)
    source[label[::-1]] = mesh.triangles.reshape(-1)[::-1]  # the last write wins, so backwards keeps the first
    which = np.empty(labels, dtype=np.int64)
    which[label] = group
    return _gather(mesh, source, label, normals=normals[which])


def with_tangents(mesh: Mesh) -> Mesh:
    """The mesh with a tangent frame at every vertex; the mesh must have normals.

    With uvs, t follows dp/du, weighted by angle over the triangles around a vertex, and w is the handedness of the
    uvs; a vertex between mirrored and unmirrored triangles is split. Elsewhere t follows `brushed`, with w = +1.
    """
    if mesh.normals is None:
        raise ValueError("with_tangents needs a mesh with normals: call with_normals first")
    if mesh.uvs is None:
        t = brushed(mesh.normals)
        return replace(mesh, tangents=np.column_stack([t, np.ones(len(t))]).astype(np.float32))

    corners = mesh.triangles.reshape(-1)
    p = mesh.positions.astype(np.float64)[mesh.triangles]
    uv = mesh.uvs.astype(np.float64)[mesh.triangles]
    (du1, dv1), (du2, dv2) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    area = du1 * dv2 - du2 * dv1
    # dp/du times |area|: only its direction counts, and without the division it is finite for every uv.
    along_u = np.sign(area)[:, None] * (dv2[:, None] * (p[:, 1] - p[:, 0]) - dv1[:, None] * (p[:, 2] - p[:, 0]))
    along_u = normalised(along_u)[0]

    mirrored = np.repeat(area < 0, 3)
    pairs, label = np.unique(corners.astype(np.int64) << 1 | mirrored, return_inverse=True)
    split = _gather(mesh, pairs >> 1, label)
    assert split.normals is not None
    assert split.uvs is not None
    w = np.where(pairs & 1, -1.0, 1.0)
    # Summed over vertices equal in all that matters, so that a file without shared vertices gets the same tangents.
    weighted = np.repeat(along_u, 3, axis=0) * _corner_angles(mesh).reshape(-1, 1)
    alike = weld(split.positions, split.normals, split.uvs, w[:, None])
    total = _sum_by_label(weighted, alike[label], int(alike.max()) + 1)[alike]
    # Across a seam of the uvs too, unless the tangents that meet there differ, as at the poles of a sphere.
    across = weld(split.positions, split.normals, w[:, None])
    joined = _sum_by_label(weighted, across[label], int(across.max()) + 1)
    lengths = np.bincount(across[label], weights=np.linalg.norm(weighted, axis=1), minlength=len(joined))
    agree = (np.linalg.norm(joined, axis=1) > AGREEING * lengths)[across]
    total[agree] = joined[across[agree]]
    n = split.normals.astype(np.float64)
    total = normalised(total)[0]
    t = total - n * np.einsum("ij,ij->i", n, total)[:, None]
    t, length = normalised(t)
    # Under 1e-6 the uvs' direction is parallel to the normal, and what is left of it is rounding.
    lost = length < 1e-6
    t[lost], w[lost] = brushed(split.normals[lost]), 1.0
    return replace(split, tangents=np.column_stack([t, w]).astype(np.float32))


def brushed(n: npt.ArrayLike) -> Float64:
    """(..., 3) unit tangents to unit normals n (..., 3): cross(y, n), as if brushed round the y axis.

    Within 1e-6 of +-y there is no such direction; t is then the x axis, made perpendicular to n.
    """
    n = np.asarray(n, dtype=np.float64)
    t = np.stack([n[..., 2], np.zeros_like(n[..., 0]), -n[..., 0]], axis=-1)
    pole = np.hypot(n[..., 0], n[..., 2]) < POLE
    t[pole] = np.array([1.0, 0.0, 0.0]) - n[pole] * n[pole][..., :1]
    return normalised(t)[0]


def faceted(mesh: Mesh) -> Mesh:
    """The mesh for shading once a triangle: corners unshared, each with its triangle's normal and `centroids`.

    The BRDF is evaluated at the centroid, so each corner carries the mean of the three's uvs and colours beside its own
    (alpha still varies over the triangle), and of the tangents, made perpendicular to the face's normal.
    """
    split = with_normals(mesh, "face", 0.0)
    assert split.normals is not None

    def mean(array: Float32 | None) -> Float64 | None:
        if array is None:
            return None
        return np.repeat(array.astype(np.float64)[mesh.triangles].mean(axis=1), 3, axis=0)

    def single(array: Float64 | None) -> Float32 | None:
        return None if array is None else array.astype(np.float32)

    tangents = None
    if mesh.tangents is not None:
        n = split.normals.astype(np.float64)
        mean_t = mean(mesh.tangents[:, :3])
        assert mean_t is not None
        t, length = normalised(mean_t - n * np.einsum("ij,ij->i", n, mean_t)[:, None])
        w = np.repeat(mesh.tangents[mesh.triangles[:, 0], 3], 3)
        lost = length < 1e-6
        t[lost], w[lost] = brushed(n[lost]), 1.0
        tangents = np.column_stack([t, w]).astype(np.float32)
    return replace(
        split,
        tangents=tangents,
        centroids=single(mean(mesh.positions)),
        centroid_uvs=single(mean(mesh.uvs)),
        centroid_colours=single(mean(mesh.colours)),
    )


def in_local_order(mesh: Mesh) -> Mesh:
    """The same triangles along a Morton curve of their centroids, vertices numbered by first use.

    A software rasteriser fetches each vertex from memory once instead of many times: scattered meshes of a million
    triangles draw 2.5 times as fast. Unused vertices are dropped. Between triangles of equal depth the first drawn
    wins, so coplanar overlaps, and only they, may look different.
    """
    if mesh.is_local:
        return mesh
    place = _along_curve(mesh)
    # Two radix sorts of 16 bits take half the time of one sort by comparison.
    order = np.argsort(place.astype(np.uint16), kind="stable")
    order = order[np.argsort((place >> np.uint32(16)).astype(np.uint16)[order], kind="stable")]
    corners = mesh.triangles[order].reshape(-1)
    first = np.empty(len(mesh.positions), dtype=np.int64)
    here = np.arange(len(corners))
    first[corners[::-1]] = here[::-1]  # the last write wins, so backwards keeps the first
    used = corners[first[corners] == here]
    number = np.empty(len(mesh.positions), dtype=np.uint32)
    number[used] = np.arange(len(used), dtype=np.uint32)
    local = _gather(mesh, used, number[corners])
    local.__dict__["is_local"] = True
    return local


def ordered(mesh: Mesh) -> Mesh:
    """The mesh in local order where that counts."""
    return in_local_order(mesh) if len(mesh.triangles) > ORDERED_ABOVE else mesh


def _along_curve(mesh: Mesh) -> UInt32:
    """(T,) place of each triangle's centroid on a Morton curve through the bounding box."""
    low, high = _box(mesh.positions)
    size = float((high - low).max()) or 1.0
    a, b, c = mesh.triangles.astype(np.intp).T
    place = np.zeros(len(a), dtype=np.uint32)
    for axis in range(3):  # 10 bits an axis: a grid of 1024 cells is finer than what a cache line can tell apart
        x = mesh.positions[:, axis] - low[axis]
        cell = ((x[a] + x[b] + x[c]) * np.float32(1023 / 3 / size)).astype(np.intp)
        place |= _SPREAD.take(cell, mode="clip") << np.uint32(axis)
    return place


def _spread(x: UInt32) -> UInt32:
    """The low 10 bits of x, two zeros between each and the next."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        x = (x | x << np.uint32(shift)) & np.uint32(mask)
    return x


_SPREAD = _spread(np.arange(1024, dtype=np.uint32))


def _freeze(mesh: Mesh, name: str, array: Array) -> None:
    if array.flags.writeable:
        array = array.view()
        array.flags.writeable = False
    object.__setattr__(mesh, name, array)


def _matrix(array: npt.ArrayLike, columns: int, name: str) -> Float64:
    result = np.asarray(array, dtype=np.float64)
    if result.size == 0:
        raise AssetError(f"mesh has no {name}")
    if result.ndim != 2 or result.shape[1] != columns:
        raise AssetError(f"mesh {name} have shape {result.shape}, not (n, {columns})")
    return result


def _indices(array: npt.ArrayLike, count: int) -> UInt32:
    result = np.asarray(array)
    if result.size == 0:
        raise AssetError("mesh has no triangles")
    if result.ndim != 2 or result.shape[1] != 3 or result.dtype.kind not in "iu":
        raise AssetError(f"mesh triangles are {result.dtype} of shape {result.shape}, not integers of shape (n, 3)")
    for index in (int(result.min()), int(result.max())):
        if not 0 <= index < count:
            raise AssetError(f"triangle index {index} is out of range: the mesh has {count} vertices")
    return result.astype(np.uint32)


def _box(p: Array) -> tuple[Array, Array]:
    """Least and greatest corner of the bounding box of p (V, 3)."""
    columns = [p[:, axis] for axis in range(3)]  # ten times as fast as along the first axis of all three at once
    return np.array([x.min() for x in columns]), np.array([x.max() for x in columns])


def _row(row: Float64) -> str:
    return " ".join(f"{x:g}" for x in row)


def normalised(v: Float64) -> tuple[Float64, Float64]:
    """Unit vectors (N, 3) along v and their lengths (N,); both 0 where v is zero or not finite.

    Scaled by the largest component first: the square of 1e-200 is 0.
    """
    x, y, z = np.abs(v[:, 0]), np.abs(v[:, 1]), np.abs(v[:, 2])  # numpy is slow along an axis of three
    scale = np.maximum(np.maximum(x, y), z)
    good = (scale > 0) & np.isfinite(scale)
    if good.all():
        unit = v / scale[:, None]
    else:
        scale = np.where(good, scale, 1.0)
        unit = np.where(good[:, None], v, 0.0) / scale[:, None]
    length = np.sqrt(np.einsum("ij,ij->i", unit, unit))
    unit /= np.where(good, length, 1.0)[:, None]
    with np.errstate(over="ignore"):
        return unit, length * scale


def _by_corner(mesh: Mesh, centre: Float64 | float = 0.0) -> list[list[Float64]]:
    """x, y and z (T,) of the first corners, of the second and of the third, relative to `centre`.

    Nine arrays, not one of (T, 3, 3): numpy is many times as fast along an axis of a million as along one of three.
    """
    p = np.ascontiguousarray((mesh.positions.astype(np.float64) - centre).T)
    return [[p[axis][corner] for axis in range(3)] for corner in mesh.triangles.astype(np.intp).T]


def _area_vectors(mesh: Mesh) -> Float64:
    """(T, 3) twice the area times the normal.

    In float64 no edge between float32 positions overflows or vanishes here, squared twice over, so unlike in a shader
    the edges need no scaling before their cross product.
    """
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = _by_corner(mesh)
    x1, y1, z1 = bx - ax, by - ay, bz - az
    x2, y2, z2 = cx - ax, cy - ay, cz - az
    result = np.empty((len(ax), 3))
    result[:, 0] = y1 * z2 - z1 * y2
    result[:, 1] = z1 * x2 - x1 * z2
    result[:, 2] = x1 * y2 - y1 * x2
    return result


def _corner_angles(mesh: Mesh) -> Float64:
    """(T, 3) [rad]; by atan2, which is as exact for slivers as for other triangles."""
    p = _by_corner(mesh)
    area = np.linalg.norm(_area_vectors(mesh), axis=1)
    angles = np.empty((len(area), 3))
    for k in range(3):
        (x, y, z), (x1, y1, z1), (x2, y2, z2) = p[k], p[k - 2], p[k - 1]
        angles[:, k] = np.arctan2(area, (x1 - x) * (x2 - x) + (y1 - y) * (y2 - y) + (z1 - z) * (z2 - z))
    return angles


def weld(*columns: Array) -> Int64:
    """(V,) labels from 0 in order of first use, equal where the rows of all given (V, n) arrays are exactly equal.

    -0 equals 0. Every row is written into a hash table and looked up again; rows that find another there, because it
    hashes alike and came first, go into the next round, with another hash. That takes a quarter of a sort's time.
    """
    words = left = [word for array in columns for word in _words(array)]
    count = len(words[0])
    bits = max(2 * count - 1, 1).bit_length()
    table = np.empty(1 << bits, dtype=np.int64)
    factor = 1
    alike = rows = np.arange(count)
    while len(rows):
        mixed = np.zeros(len(rows), dtype=np.uint64)
        for word in left:
            factor = (factor * 6364136223846793005 + 1442695040888963407) % 2**64  # Knuth's generator for MMIX
            mixed += word * np.uint64(factor | 1)
        mixed ^= mixed >> np.uint64(32)
        mixed *= np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: Fibonacci hashing
        mixed >>= np.uint64(64 - bits)
        slot = mixed.view(np.int64)
        table[slot] = rows
        found = table[slot]
        if len(rows) == count:
            alike = found
        else:
            alike[rows] = found
        different = words[0][found] != left[0]
        for word, own in zip(words[1:], left[1:], strict=True):
            different |= word[found] != own
        rows = rows[different]
        left = [word[rows] for word in words]
    kept = np.flatnonzero(alike == np.arange(count))
    label = np.empty(count, dtype=np.int64)
    label[kept] = np.arange(len(kept))
    return label[alike]


def _words(array: Array) -> list[UInt64]:
    """The rows of an array (V, n) as a few (V,) words of 64 bits, equal where the rows are equal."""
    array = array + 0  # -0 becomes 0
    if array.itemsize == 4:
        padded = np.zeros((len(array), (array.shape[1] + 1) // 2 * 2), dtype=array.dtype)
        padded[:, : array.shape[1]] = array
        array = padded
    return list(np.ascontiguousarray(np.ascontiguousarray(array).view(np.uint64).T))


def _fans(mesh: Mesh, place: Int64, threshold: float) -> tuple[Int64, int]:
    """Groups of triangle corners that share a normal: (3T,) group of each corner, from 0, and the number of groups.

    Two corners at one place are joined where an edge runs from it that both their triangles have and that bends by
    no more than the threshold; what is joined through others is joined.
    """
    corners = place[mesh.triangles]
    count = corners.size
    tail, head = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
    forth = tail < head
    key = np.where(forth, tail << 32 | head, head << 32 | tail)
    # The corners at the edge's lesser and greater end, in its triangle.
    here = np.arange(count)
    there = np.roll(here.reshape(-1, 3), -1, axis=1).reshape(-1)
    lesser, greater = np.where(forth, here, there), np.where(forth, there, here)
    order = np.argsort(key, kind="stable")
    order = order[tail[order] != head[order]]  # an edge without length joins nothing
    key = key[order]
    n = face_normals(mesh)
    flat = np.einsum("ij,ij->i", n, n) == 0
    # Angles by the chord between unit normals, |n1 - n2| = 2 sin(angle/2): exact for small ones, unlike the cosine.
    angle = np.radians(min(threshold + THRESHOLD_SLACK, 180.0))
    chord2 = 4 * np.sin(angle / 2) ** 2 if angle < np.pi else np.inf
    one, other = [], []
    # Neighbours in the sorted list share an edge; where more than two triangles do, those farther off do too. Beyond
    # eight the mesh is broken, and comparing all with all would take quadratic time.
    for step in range(1, 9):
        same = np.flatnonzero(key[step:] == key[:-step])
        if len(same) == 0:
            break
        e1, e2 = order[same], order[same + step]
        t1, t2 = e1 // 3, e2 // 3
        difference = n.take(t1, axis=0) - n.take(t2, axis=0)
        bend = np.einsum("ij,ij->i", difference, difference)
        bend[flat[t1] | flat[t2]] = 2.0
        smooth = bend <= chord2
        e1, e2 = e1[smooth], e2[smooth]
        one += [lesser[e1], greater[e1]]
        other += [lesser[e2], greater[e2]]
    return _components(count, np.concatenate(one), np.concatenate(other)) if one else (here, count)


def _components(count: int, one: Int64, other: Int64) -> tuple[Int64, int]:
    """Connected components of the graph with nodes 0..count-1 and edges one[i]-other[i]: labels from 0, and how many.

    Each round hooks the roots at the two ends of every edge together, the greater under the lesser, then shortens
    all paths to their roots (Shiloach and Vishkin 1982): a handful of rounds for the fans of a mesh.
    """
    root = np.arange(count)
    while len(one):
        a, b = root[one], root[other]
        apart = a != b
        one, other, a, b = one[apart], other[apart], a[apart], b[apart]
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while True:
            shorter = root[root]
            if np.array_equal(shorter, root):
                break
            root = shorter
    is_root = root == np.arange(count)
    number = np.cumsum(is_root) - 1
    return number[root], int(number[-1]) + 1


def _sum_by_label(values: Float64, label: Int64, count: int) -> Float64:
    """(count, 3) sums of the rows of values (N, 3) with equal labels (N,)."""
    return np.stack([np.bincount(label, weights=values[:, k], minlength=count) for k in range(3)], axis=1)


def _smooth_by_label(mesh: Mesh, label: Int64, count: int) -> Float64:
    """(count, 3) unit normals: the angle-weighted mean over the triangle corners (3T,) with that label.

    Where they cancel, the normal of one of the triangles; where those have no area, FALLBACK_NORMAL.
    """
    n = face_normals(mesh)
    angle = _corner_angles(mesh).reshape(-1)
    corner = np.repeat(n, 3, axis=0)
    result, length = normalised(_sum_by_label(corner * angle[:, None], label, count))
    # A mean of a few unit vectors that comes out under 1e-7 is rounding of float32 positions.
    lost = length <= 1e-7 * np.bincount(label, weights=angle, minlength=count)
    if lost.any():
        stand_in = np.tile(np.array(FALLBACK_NORMAL), (count, 1))
        useful = np.flatnonzero(lost[label] & corner.any(axis=1))[::-1]
        stand_in[label[useful]] = corner[useful]
        result[lost] = stand_in[lost]
    return result


def _gather(mesh: Mesh, source: Array, corners: Array, normals: Float64 | None = None) -> Mesh:
    """The mesh with vertices mesh[source] and triangles `corners` (3T,).

    New normals, one for each new vertex, end the tangents; without them both are kept.
    """

    def take(array: Float32 | None) -> Float32 | None:
        return None if array is None else array.take(source, axis=0)  # four times as fast as array[source]

    return Mesh(
        positions=mesh.positions.take(source, axis=0),
        triangles=corners.astype(np.uint32).reshape(-1, 3),
        normals=take(mesh.normals) if normals is None else normals.astype(np.float32),
        uvs=take(mesh.uvs),
        tangents=take(mesh.tangents) if normals is None else None,
        colours=take(mesh.colours),
        origin=mesh.origin,
        centroids=take(mesh.centroids),
        centroid_uvs=take(mesh.centroid_uvs),
        centroid_colours=take(mesh.centroid_colours),
    )
