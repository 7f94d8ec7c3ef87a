"""Strokes: checks the arrays of points and lines, and returns meshes of them. The view turns these into triangles later."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from glshade.arrays import Float32, Float64, Int64
from glshade.errors import AssetError
from glshade.mesh.checking import matrix
from glshade.mesh.geometry import centred
from glshade.mesh.mesh import Mesh
from glshade.mesh.welding import normalised


def segments(order: npt.ArrayLike, mode: Literal["lines", "strip", "loop"]) -> Int64:
    """Returns the lines (L, 2) that OpenGL assembles from vertices (OpenGL 4.6 core profile, 10.1).

    order: the indices (N,) of the vertices. A vertex without a partner is left out.
    mode: "lines" joins two vertices at a time, "strip" joins each vertex to the next, "loop" also joins the last to the first.
    """
    vertices: Int64 = np.asarray(order, dtype=np.int64).reshape(-1)
    if mode == "lines":
        return vertices[: len(vertices) // 2 * 2].reshape(-1, 2)
    if mode == "loop":
        vertices = np.append(vertices, vertices[:1])
    return np.stack([vertices[:-1], vertices[1:]], axis=1)


def build_strokes(
    positions: npt.ArrayLike,
    strokes: npt.ArrayLike,
    normals: npt.ArrayLike | None = None,
    uvs: npt.ArrayLike | None = None,
    colours: npt.ArrayLike | None = None,
) -> tuple[Mesh, int]:
    """Returns a mesh of points and lines, and the number of strokes that were left out because a position is not finite.

    Vertices that no stroke uses are dropped. Values of uvs and colours that are not finite become 0 and 1, as in triangles.

    positions: (V, 3).
    strokes: (S, 2) integers, the two vertices of each line; twice the same vertex is a point.
    normals: (V, 3) of any length. A zero, infinite or NaN normal stands for no normal; where none is left, the mesh has none.
    uvs: (V, 2); v = 0 is the bottom of the picture.
    colours: (V, 4), linear Rec. 709 with straight alpha.

    The origin of the mesh is chosen as in `Mesh.build`.

    Errors: AssetError for no stroke with finite positions, an array of a wrong shape, a position too large for float32, or an
    index out of range.
    """
    p = matrix(positions, 3, "positions")
    lines = _checked(strokes, len(p))
    sound: Any = np.isfinite(p).all(axis=1)
    finite = sound[lines].all(axis=1)
    lost = len(lines) - int(finite.sum())
    if lost == len(lines):
        raise AssetError("has no point or line whose positions are finite numbers")
    lines = lines[finite] if lost else lines
    used = np.zeros(len(p), dtype=np.bool_)
    used[lines] = True
    whole = bool(used.all())
    number = np.cumsum(used) - 1

    def of_used(array: npt.ArrayLike | None, columns: int, name: str, instead: float | None = None) -> Float64 | None:
        """Returns the values (U, columns) of the vertices in use, with `instead`, if it is given, where one is not finite."""
        if array is None:
            return None
        values = matrix(array, columns, name)
        if len(values) != len(p):
            raise AssetError(f"mesh has {len(p)} positions and {len(values)} {name}")
        values = values if whole else values[used]
        return values if instead is None else np.where(np.isfinite(values), values, instead)

    n = of_used(normals, 3, "normals")
    if n is not None:
        n, length = normalised(n)
        n = None if not length.any() else n
    origin, relative = centred(p if whole else p[used])
    return (
        Mesh(
            positions=relative.astype(np.float32),
            triangles=np.zeros((0, 3), dtype=np.uint32),
            normals=None if n is None else n.astype(np.float32),
            uvs=_rounded(of_used(uvs, 2, "uvs", 0.0)),
            colours=_rounded(of_used(colours, 4, "colours", 1.0)),
            origin=origin,
            strokes=(lines if whole else number[lines]).astype(np.uint32),
        ),
        lost,
    )


def _checked(strokes: npt.ArrayLike, count: int) -> Int64:
    """Returns the strokes (S, 2) of a mesh with `count` vertices. Errors: AssetError."""
    lines = np.asarray(strokes)
    if lines.size == 0:
        raise AssetError("mesh has no points or lines")
    if lines.ndim != 2 or lines.shape[1] != 2 or lines.dtype.kind not in "iu":
        raise AssetError(f"mesh lines are {lines.dtype} of shape {lines.shape}, not integers of shape (n, 2)")
    for index in (int(lines.min()), int(lines.max())):
        if not 0 <= index < count:
            raise AssetError(f"index {index} of a point or line is out of range: the mesh has {count} vertices")
    return lines.astype(np.int64)


def _rounded(values: Float64 | None) -> Float32 | None:
    return None if values is None else values.astype(np.float32)
