"""Vertices: meshes on the GPU, with the attributes that a program asks for and no others."""

from __future__ import annotations

from collections.abc import Callable
from weakref import WeakKeyDictionary

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.mesh.mesh import Mesh

ATTRIBUTES = {
    "a_position": ("positions", 3),
    "a_normal": ("normals", 3),
    "a_tangent": ("tangents", 4),
    "a_uv": ("uvs", 2),
    "a_colour": ("colours", 4),
    "a_centroid": ("centroids", 3),
    "a_centroid_uv": ("centroid_uvs", 2),
    "a_centroid_colour": ("centroid_colours", 4),
}


class Vertices:
    """The buffers of a context, by mesh; they go when their mesh goes."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._buffers: WeakKeyDictionary[Mesh, dict[tuple[str, ...], moderngl.Buffer]] = WeakKeyDictionary()
        self._arrays: WeakKeyDictionary[Mesh, dict[Program, moderngl.VertexArray]] = WeakKeyDictionary()

    def array(self, mesh: Mesh, program: Program, triangles: NDArray[np.uint32] | None = None) -> moderngl.VertexArray:
        """The mesh, ready to be drawn by the program. triangles: (N, 3), those to draw; None: all."""
        if triangles is not None:
            return self._array(mesh, program, self._context.gl.buffer(triangles.data))
        kept = self._arrays.setdefault(mesh, {})
        if program not in kept:
            kept[program] = self._array(mesh, program, self._buffer(mesh, (), mesh.triangles.tobytes))
        return kept[program]

    def _array(self, mesh: Mesh, program: Program, indices: moderngl.Buffer) -> moderngl.VertexArray:
        names = tuple(name for name in program.attributes if name in ATTRIBUTES)
        sizes = [ATTRIBUTES[name][1] for name in names]
        buffer = self._buffer(mesh, names, lambda: _interleaved(mesh, names))
        layout = " ".join(f"{size}f" for size in sizes)
        return self._context.gl.vertex_array(program.gl, [(buffer, layout, *names)], indices)

    def _buffer(self, mesh: Mesh, key: tuple[str, ...], data: Callable[[], bytes]) -> moderngl.Buffer:
        """key: the attributes; none for the triangles."""
        kept = self._buffers.setdefault(mesh, {})
        if key not in kept:
            kept[key] = self._context.gl.buffer(data())
        return kept[key]


def _interleaved(mesh: Mesh, names: tuple[str, ...]) -> bytes:
    """Vertex after vertex: what one vertex needs lies together."""
    return np.hstack([getattr(mesh, ATTRIBUTES[name][0]) for name in names]).tobytes()
