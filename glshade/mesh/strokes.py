"""Strokes: checks the arrays of points and lines, and returns meshes of them. The view turns these into triangles later."""

from __future__ import annotations

import hashlib
from dataclasses import fields
from functools import cached_property
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


class DirectedPoints(Mesh):
    """Points whose normals stay as they are given. Those of other points turn to the viewer. A zero normal still stands for
    the direction to the viewer.
    """

    @classmethod
    def of(cls, mesh: Mesh) -> DirectedPoints:
        """Returns the points of a mesh, with zero normals where it has none."""
        arrays = {f.name: getattr(mesh, f.name) for f in fields(mesh)}
        if mesh.normals is None:
            arrays["normals"] = _given(np.zeros_like(mesh.positions))
        return cls(**arrays)

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the arrays and of what they stand for, as 64 hex digits."""
        return hashlib.sha256(f"directed points {super().digest}".encode()).hexdigest()


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
    lost, used = 0, None
    if not np.isfinite(p).all():
        sound: Any = np.isfinite(p).all(axis=1)
        finite = sound[lines].all(axis=1)
        lost = len(lines) - int(finite.sum())
        if lost == len(lines):
            raise AssetError("has no point or line whose positions are finite numbers")
        lines = lines[finite]
    in_use = np.zeros(len(p), dtype=np.bool_)
    in_use[lines.reshape(-1)] = True
    if not in_use.all():
        used = in_use
        lines = (np.cumsum(used) - 1)[lines]
    n, uv, c = (
        _of_used(array, columns, name, len(p), used)
        for array, columns, name in ((normals, 3, "normals"), (uvs, 2, "uvs"), (colours, 4, "colours"))
    )
    origin, relative = centred(p if used is None else p[used])
    mesh = Mesh(
        positions=_given(relative.astype(np.float32)),
        triangles=np.zeros((0, 3), dtype=np.uint32),
        normals=None if n is None else _unit_or_none(n),
        uvs=None if uv is None else _finite(uv, 0.0),
        colours=None if c is None else _finite(c, 1.0),
        origin=origin,
        strokes=_given(lines.astype(np.uint32)),
    )
    return mesh, lost


def _given(array: Any) -> Any:
    """Returns the array, which is read-only from now on, so that Mesh need not copy it."""
    array.flags.writeable = False
    return array


def _finite(values: Float64, instead: float) -> Float32:
    """Returns values (V, n) as float32, with `instead` in place of values that are not finite."""
    result: Float32 = values.astype(np.float32)
    finite: Any = np.isfinite(values)
    if not finite.all():
        result[~finite] = instead
    result.flags.writeable = False
    return result


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
    return lines.astype(np.int64, copy=False)


def _of_used(
    array: npt.ArrayLike | None, columns: int, name: str, count: int, used: NDArray[np.bool_] | None
) -> Float64 | None:
    """Returns the rows of an attribute (V, columns) that belong to vertices in use, as float64; None for None.

    count: the number V of vertices.
    used: (V,), whether each vertex is used; None where all are.
    Errors: AssetError, with the attribute's name.
    """
    if array is None:
        return None
    values = matrix(array, columns, name)
    if len(values) != count:
        raise AssetError(f"mesh has {count} positions and {len(values)} {name}")
    return values if used is None else values[used]


def _unit_or_none(normals: Float64) -> Float32 | None:
    """Returns normals (V, 3) made unit, with 0 for those without a direction; None if none has a direction."""
    unit, length = normalised(normals)
    return unit.astype(np.float32) if length.any() else None
