"""Mesh: an indexed triangle mesh whose arrays cannot be changed.

This package imports only NumPy, because importing SciPy or trimesh would take longer than the work that they would do. Arrays
are float32, because both renderers are given these bytes. Intermediate sums and angles are computed in float64.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from glshade.arrays import Array, Float32, Float64, UInt32
from glshade.errors import AssetError
from glshade.mesh.checking import indices, matrix, row
from glshade.mesh.geometry import box, by_corner, smooth_by_label
from glshade.mesh.welding import normalised, weld

# The number of columns of each optional array.
_COLUMNS = {
    "normals": 3,
    "uvs": 2,
    "tangents": 4,
    "colours": 4,
    "centroids": 3,
    "centroid_uvs": 2,
    "centroid_colours": 4,
}


@dataclass(frozen=True, eq=False)
class Mesh:
    """An indexed triangle mesh; all arrays are contiguous and read-only. An array that somebody could write to is copied.

    positions: (V, 3) float32, relative to `origin`.
    triangles: (T, 3) uint32, counter-clockwise seen from outside.
    normals: (V, 3) float32, unit.
    uvs: (V, 2) float32; v = 0 is the bottom of the picture.
    tangents: (V, 4) float32. x, y and z are the tangent t, unit and perpendicular to the normal n. w is +-1, and the bitangent
        is w cross(n, t).
    colours: (V, 4) float32, linear Rec. 709 with straight alpha.
    origin: (3,) float64. A vertex lies at origin + position in object space, so that a mesh far from 0 keeps its precision.
    centroids: (V, 3) float32, the mean position of the triangle to which the vertex belongs. Only `faceted` sets the means.
    centroid_uvs: (V, 2) float32, the mean uvs of that triangle.
    centroid_colours: (V, 4) float32, the mean colour of that triangle.

    Errors: AssetError for arrays whose shapes do not match.
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
            array = _own(np.array(getattr(self, name), dtype=dtype, order="C", copy=None))
            if array.ndim != 2 or array.shape[1] != columns:
                raise AssetError(f"mesh {name} have shape {array.shape}, not (n, {columns})")
            object.__setattr__(self, name, array)

        settle("positions", np.float32, 3)
        settle("triangles", np.uint32, 3)
        for name, columns in _COLUMNS.items():
            if getattr(self, name) is not None:
                settle(name, np.float32, columns)
                if len(getattr(self, name)) != len(self.positions):
                    raise AssetError(f"mesh has {len(self.positions)} positions and {len(getattr(self, name))} {name}")
        if len(self.triangles) and int(self.triangles.max()) >= len(self.positions):
            raise AssetError(f"triangle index {self.triangles.max()} is out of range: {len(self.positions)} vertices")
        object.__setattr__(self, "origin", _own(np.array(self.origin, dtype=np.float64).reshape(3)))

    @classmethod
    def build(
        cls,
        positions: npt.ArrayLike,
        triangles: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        colours: npt.ArrayLike | None = None,
    ) -> Mesh:
        """Checks arrays and returns a mesh made from them.

        positions: (V, 3).
        triangles: (T, 3) integers, counter-clockwise seen from outside.
        normals: (V, 3) of any length. A zero, infinite or NaN normal is replaced by the smooth normal of its vertex.
        uvs: (V, 2); v = 0 is the bottom of the picture.
        colours: (V, 4), linear Rec. 709 with straight alpha.

        The origin of the mesh becomes the centre of the bounding box if that centre is farther from 0 than the box's diagonal
        is long. Otherwise the origin is 0, and positions that were float32 keep their exact bytes.

        Errors: AssetError for a mesh without triangles, an array of a wrong shape, an infinity or a NaN, a position too large
        for float32, or an index out of range.
        """
        p = matrix(positions, 3, "positions")
        t = indices(triangles, len(p))
        if not np.isfinite(p).all():
            bad = int(np.flatnonzero(~np.isfinite(p).all(axis=1))[0])
            raise AssetError(f"vertex {bad} (of {len(p)}, from 0) is not finite: {row(p[bad])}")
        low, high = box(p)
        centre = low / 2 + high / 2  # the sum of two large numbers might overflow, so both are halved first
        with np.errstate(over="ignore"):
            far = np.linalg.norm(centre) > np.linalg.norm(high - low)
        origin = centre if far else np.zeros(3)
        p = p - origin
        if np.abs(p).max() > np.finfo(np.float32).max:
            raise AssetError(f"positions reach {np.abs(p).max():g}, too large for float32")

        def optional(array: npt.ArrayLike | None, columns: int, name: str) -> Float32 | None:
            if array is None:
                return None
            return matrix(array, columns, name).astype(np.float32)

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
        n, length = normalised(matrix(normals, 3, "normals"))
        if len(n) != len(p):
            raise AssetError(f"mesh has {len(p)} positions and {len(n)} normals")
        lost = length == 0
        if lost.any():
            label = weld(mesh.positions)
            n[lost] = smooth_by_label(mesh, label[mesh.triangles.reshape(-1)], int(label.max()) + 1)[label[lost]]
        return replace(mesh, normals=n.astype(np.float32))

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the names, shapes and bytes of all arrays, as 64 hex digits."""
        h = hashlib.sha256()
        for f in fields(self):
            array = getattr(self, f.name)
            if array is not None:
                h.update(f"{f.name}{array.shape}".encode())
                h.update(array.data)
        return h.hexdigest()

    @property
    def nbytes(self) -> int:
        """The memory that the arrays take [bytes]."""
        arrays = (getattr(self, f.name) for f in fields(self))
        return sum(array.nbytes for array in arrays if array is not None)

    @cached_property
    def bounds(self) -> Float64:
        """(2, 3) float64, the least and the greatest corner of the bounding box in object space."""
        return np.stack(box(self.positions)).astype(np.float64) + self.origin

    @cached_property
    def is_solid(self) -> bool:
        """Whether the mesh is closed and wound counter-clockwise seen from outside. Its back faces may then be culled.

        Vertices at exactly equal positions count as one, and triangles with two such corners do not count. The mesh is solid
        if every directed edge occurs once, its reverse occurs once, and the signed volume is positive.
        """
        place = weld(self.positions)
        a, b, c = (place[corner] for corner in self.triangles.astype(np.intp).T)
        flat = (a == b) | (b == c) | (c == a)
        if flat.any():
            a, b, c = a[~flat], b[~flat], c[~flat]
        tail, head = np.concatenate([a, b, c]), np.concatenate([b, c, a])
        edge = weld((np.minimum(tail, head) << 32 | np.maximum(tail, head))[:, None])
        # If there are as many directed edges as sides of triangles, and every directed edge occurs, each occurs exactly once.
        sides = np.bincount(edge << 1 | (tail < head), minlength=1)
        if len(sides) != len(edge) or not sides.all():
            return False
        (x1, y1, z1), (x2, y2, z2), (x3, y3, z3) = by_corner(self, self.positions.mean(axis=0, dtype=np.float64))
        terms = x1 * (y2 * z3 - z2 * y3) + y1 * (z2 * x3 - x2 * z3) + z1 * (x2 * y3 - y2 * x3)
        # A sheet folded onto itself is closed too, but its volume consists of rounding errors.
        return bool(terms.sum() > 1e-12 * np.abs(terms).sum())


def _own(array: Array) -> Array:
    """Returns the array itself if nobody can write to it, as with the arrays of another mesh; else a read-only copy."""
    owner: Any = array
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            array = array.copy()
            array.flags.writeable = False
            break
        owner = owner.base
    return array


def gather(mesh: Mesh, source: Array, corners: Array, normals: Float64 | None = None) -> Mesh:
    """Returns a mesh whose vertex i is vertex source[i] (V,) of the given mesh, with the triangles `corners` (3T,).

    normals: optional new normals (V, 3). If they are given, the tangents are dropped, because those belong to the old normals.
    """

    def take(array: Float32 | None) -> Float32 | None:
        return None if array is None else array.take(source, axis=0)  # four times as fast as indexing

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
