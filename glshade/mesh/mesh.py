"""Mesh: an indexed triangle mesh whose arrays cannot be changed.

This package imports only NumPy, because importing SciPy would take longer than the work that they would do. Arrays
are float32, because both renderers are given these bytes. Intermediate sums and angles are computed in float64.
"""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from glshade.arrays import Array, Float32, Float64, UInt32
from glshade.errors import AssetError, AssetWarning
from glshade.mesh.checking import Arrays, Faults, checked, nothing_finite
from glshade.mesh.fans import of_one_group, split
from glshade.mesh.frames import framed
from glshade.mesh.geometry import Triangles, box, by_corner, centred, in_use, normals_and_angles, smooth_by_label
from glshade.mesh.topology import topology_of
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
    neighbours: (N, 3, 3) float32, the corners of triangles that belong to other parts of the same surface and touch this mesh,
        relative to `origin`. They are not drawn, but normals are smooth across the border to them.
    strokes: (S, 2) uint32, the lines of a mesh of points and lines, which has no triangles; None for a mesh of triangles. A
        line joins two vertices; a line from a vertex to itself is a point. A normal may be zero there, which stands for none.

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
    strokes: UInt32 | None = None
    neighbours: Float32 | None = None

    def __post_init__(self) -> None:
        def settle(name: str, dtype: type[Any], columns: int) -> None:
            array = _own(np.array(getattr(self, name), dtype=dtype, order="C", copy=None))
            if array.ndim != 2 or array.shape[1] != columns:
                raise AssetError(f"mesh {name} have shape {array.shape}, not (n, {columns})")
            object.__setattr__(self, name, array)

        settle("positions", np.float32, 3)
        settle("triangles", np.uint32, 3)
        if self.strokes is not None:
            settle("strokes", np.uint32, 2)
        for name, columns in _COLUMNS.items():
            if getattr(self, name) is not None:
                settle(name, np.float32, columns)
                if len(getattr(self, name)) != len(self.positions):
                    raise AssetError(f"mesh has {len(self.positions)} positions and {len(getattr(self, name))} {name}")
        if self.neighbours is not None:
            object.__setattr__(self, "neighbours", _own(np.array(self.neighbours, np.float32, order="C", copy=None)))
        for name, rows in (("triangle", self.triangles), ("line", self.strokes)):
            if rows is not None and len(rows) and int(rows.max()) >= len(self.positions):
                raise AssetError(f"{name} index {rows.max()} is out of range: {len(self.positions)} vertices")
        object.__setattr__(self, "origin", _own(np.array(self.origin, dtype=np.float64).reshape(3)))

    @classmethod
    def build(
        cls,
        positions: npt.ArrayLike,
        triangles: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        colours: npt.ArrayLike | None = None,
        *,
        smoothing: npt.ArrayLike | None = None,
        tangents: npt.ArrayLike | None = None,
    ) -> Mesh:
        """Checks arrays and returns a mesh made from them.

        positions: (V, 3). Vertices that no triangle uses are left out.
        triangles: (T, 3) integers, counter-clockwise seen from outside.
        normals: (V, 3) of any length. A zero, infinite or NaN normal is replaced by the smooth normal of its vertex.
            If no normal has a direction, as in files of programs that write zeros, the mesh has no normals.
        uvs: (V, 2); v = 0 is the bottom of the picture.
        colours: (V, 4), linear Rec. 709 with straight alpha.
        smoothing: (T,) integers, for a mesh without normals. It gets normals that are smooth among the triangles with equal
            numbers, whatever their angles, and sharp between others; a triangle with the number 0 is flat.
        tangents: (V, 4), for a mesh with normals: directions of any length, and a number whose sign is that of the bitangent.
            A tangent without a direction across its normal is replaced by that of `brushed`.

        The origin of the mesh becomes the centre of the bounding box if that centre is farther from 0 than the box's diagonal
        is long. Otherwise the origin is 0, and positions that were float32 keep their exact bytes.

        Triangles with an infinite or NaN position are left out, infinite and NaN uvs become 0, and such colours white. Warns
        with AssetWarning, with the numbers of triangles and vertices.

        Errors: AssetError for a mesh without triangles whose positions are finite, an array of a wrong shape, a position too
        large for float32, or an index out of range.
        """
        faults = Faults()
        arrays = checked(positions, triangles, normals, uvs, colours, smoothing=smoothing, tangents=tangents, faults=faults)
        if arrays is None:
            raise AssetError(nothing_finite(faults))
        for line in faults.lines():
            warnings.warn(line, AssetWarning, stacklevel=2)
        mesh = cls.of_arrays(arrays, *centred(arrays.positions))
        # The checks have left out the vertices that no triangle uses, so that nobody need search for them again.
        vars(mesh)["is_whole"] = True
        return mesh

    @classmethod
    def of_arrays(
        cls, arrays: Arrays, origin: Float64, relative: Array, neighbours: Float32 | None = None, groups: Array | None = None
    ) -> Mesh:
        """Returns the mesh of arrays that were checked.

        origin: the origin (3,) of the mesh.
        relative: (V, 3) the positions relative to the origin.
        neighbours: as in `Mesh`.
        groups: (N,) the smoothing groups of the neighbours.
        """
        mesh = cls(
            positions=relative.astype(np.float32, copy=False),
            triangles=arrays.triangles,
            uvs=arrays.uvs,
            colours=arrays.colours,
            origin=origin,
            neighbours=neighbours,
        )
        if arrays.normals is not None:
            n, length = normalised(arrays.normals)
            if length.any():
                return mesh._with_given(n, length == 0, arrays.tangents)
        if arrays.smoothing is None:
            return mesh
        numbers = arrays.smoothing if groups is None else np.concatenate([arrays.smoothing, groups])
        attributes = [a for a in (mesh.uvs, mesh.colours) if a is not None]
        made = split(mesh.with_neighbours(), attributes, len(mesh.triangles), lambda _: of_one_group(numbers))
        return gather(mesh, made.source, made.corners, normals=made.normals)

    def _with_given(self, n: Float64, lost: npt.NDArray[np.bool_], tangents: Float64 | None) -> Mesh:
        """Returns the mesh with the unit normals (V, 3) and the tangents (V, 4) of a file, made unit and perpendicular.

        lost: (V,) which normals have no direction. They become smooth normals.
        """
        if lost.any():
            label = weld(self.positions)
            corners, count = label[self.triangles.reshape(-1)], int(label.max()) + 1
            n[lost] = smooth_by_label(*normals_and_angles(self), corners, count)[label[lost]]
        frame = None if tangents is None else framed(n, tangents[:, :3], np.where(tangents[:, 3] < 0, -1.0, 1.0))
        return replace(self, normals=n.astype(np.float32), tangents=frame, neighbours=None)

    def with_neighbours(self) -> Triangles:
        """Returns the positions and triangles of the mesh, with its neighbours behind them."""
        if self.neighbours is None:
            return self
        more = np.arange(3 * len(self.neighbours), dtype=np.uint32).reshape(-1, 3) + np.uint32(len(self.positions))
        return Mesh(
            np.concatenate([self.positions, self.neighbours.reshape(-1, 3)]),
            np.concatenate([self.triangles, more]),
            origin=self.origin,
        )

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

    @property
    def counts(self) -> tuple[int, int]:
        """The numbers of vertices and triangles."""
        return len(self.positions), len(self.triangles)

    @cached_property
    def bounds(self) -> Float64:
        """(2, 3) float64, the least and the greatest corner of the box round the vertices in use, in object space."""
        return np.stack(box(self.drawn)).astype(np.float64) + self.origin

    @cached_property
    def is_whole(self) -> bool:
        """Whether triangles or lines use every vertex."""
        return bool(in_use(len(self.positions), self.triangles, self.strokes).all())

    @property
    def drawn(self) -> Float32:
        """The positions (U, 3) of the vertices that triangles or lines use, relative to the origin."""
        return self.positions if self.is_whole else self.positions[in_use(len(self.positions), self.triangles, self.strokes)]

    @cached_property
    def is_solid(self) -> bool:
        """Whether the mesh is closed and wound counter-clockwise seen from outside. Its back faces may then be culled.

        Vertices at exactly equal positions count as one, and triangles with two such corners do not count. The mesh is solid
        if every directed edge occurs once, its reverse occurs once, and the signed volume is positive.
        """
        # Fewer triangles than those of a tetrahedron enclose nothing.
        if len(self.triangles) < 4 or not topology_of(self).is_closed:
            return False
        total, size = 0.0, 0.0
        for _, ((x1, y1, z1), (x2, y2, z2), (x3, y3, z3)) in by_corner(self, self.bounds.mean(axis=0) - self.origin):
            terms = x1 * (y2 * z3 - z2 * y3) + y1 * (z2 * x3 - x2 * z3) + z1 * (x2 * y3 - y2 * x3)
            total, size = total + float(terms.sum()), size + float(np.abs(terms).sum())
        # A sheet folded onto itself is closed too, but its volume consists of rounding errors.
        return total > 1e-12 * size


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


def gather(mesh: Mesh, source: Array, corners: Array, normals: Array | None = None) -> Mesh:
    """Returns a mesh whose vertex i is vertex source[i] (V,) of the given mesh, with the triangles `corners` (3T,).

    normals: optional new normals (V, 3). If they are given, the tangents are dropped, because those belong to the old normals.
        The neighbours are dropped too, because only the search for normals needs them.
    """

    def take(array: Float32 | None) -> Float32 | None:
        return None if array is None else array.take(source, axis=0)  # four times as fast as indexing

    return Mesh(
        positions=mesh.positions.take(source, axis=0),
        triangles=corners.astype(np.uint32, copy=False).reshape(-1, 3),
        normals=take(mesh.normals) if normals is None else normals.astype(np.float32, copy=False),
        uvs=take(mesh.uvs),
        tangents=take(mesh.tangents) if normals is None else None,
        colours=take(mesh.colours),
        origin=mesh.origin,
        centroids=take(mesh.centroids),
        centroid_uvs=take(mesh.centroid_uvs),
        centroid_colours=take(mesh.centroid_colours),
        neighbours=mesh.neighbours if normals is None else None,
    )
