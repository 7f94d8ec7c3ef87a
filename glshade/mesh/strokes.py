"""Strokes: checks the arrays of points and lines, and returns meshes of them. The view turns these into triangles later."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

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
    n, uv, c = (
        _of_used(array, columns, name, used)
        for array, columns, name in ((normals, 3, "normals"), (uvs, 2, "uvs"), (colours, 4, "colours"))
    )
    origin, relative = centred(p[used])
    mesh = Mesh(
        positions=relative.astype(np.float32),
        triangles=np.zeros((0, 3), dtype=np.uint32),
        normals=None if n is None else _unit_or_none(n),
        uvs=None if uv is None else np.where(np.isfinite(uv), uv, 0.0).astype(np.float32),
        colours=None if c is None else np.where(np.isfinite(c), c, 1.0).astype(np.float32),
        origin=origin,
        strokes=(np.cumsum(used) - 1)[lines].astype(np.uint32),
    )
    return mesh, lost


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


def _of_used(array: npt.ArrayLike | None, columns: int, name: str, used: NDArray[np.bool_]) -> Float64 | None:
    """Returns the rows of an attribute (V, columns) that belong to vertices in use, as float64; None for None.

    used: (V,), whether each vertex is used.
    Errors: AssetError, with the attribute's name.
    """
    if array is None:
        return None
    values = matrix(array, columns, name)
    if len(values) != len(used):
        raise AssetError(f"mesh has {len(used)} positions and {len(values)} {name}")
    return values[used]


def _unit_or_none(normals: Float64) -> Float32 | None:
    """Returns normals (V, 3) made unit, with 0 for those without a direction; None if none has a direction."""
    unit, length = normalised(normals)
    return unit.astype(np.float32) if length.any() else None
