"""Vertices: uploads meshes to the GPU, with only the attributes that a program reads."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.assembly.strokes import Points, Squares
from glshade.gl.context import Context
from glshade.gl.instances import Content, InstanceBuffers
from glshade.gl.points import are_squares
from glshade.gl.program import Program
from glshade.mesh.mesh import Mesh

# Attribute in GLSL -> (attribute of Mesh, number of components).
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
    """The vertex buffers and vertex arrays of a context. They are freed together with their mesh."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._buffers: WeakKeyDictionary[Mesh, dict[tuple[str, ...], moderngl.Buffer]] = WeakKeyDictionary()
        self._arrays: WeakKeyDictionary[Mesh, WeakKeyDictionary[Program, moderngl.VertexArray]] = WeakKeyDictionary()
        # id of an array of values -> the buffer that holds it.
        self._of_values: dict[int, moderngl.Buffer] = {}

    def instanced(self, mesh: Mesh, program: Program, buffers: InstanceBuffers) -> moderngl.VertexArray:
        """Returns a vertex array that draws several instances of a mesh with a program. It is not cached."""
        array = self._array(mesh, program, self._buffer(mesh, (), lambda: mesh.triangles), buffers.content)
        array.instances = buffers.count
        return array

    def array(self, mesh: Mesh, program: Program, triangles: NDArray[np.uint32] | None = None) -> moderngl.VertexArray:
        """Returns the vertex array that draws a mesh with a program.

        mesh: the mesh to draw.
        program: the program to draw it with.
        triangles: optional; the triangles (N, 3) to draw. Such an array is not cached. Default: all triangles of the mesh.
        """
        if triangles is not None:
            return self._array(mesh, program, self._context.gl.buffer(triangles.data))
        arrays = self._arrays.setdefault(mesh, WeakKeyDictionary())
        if program not in arrays:
            points = mesh.points if isinstance(mesh, Squares) else None
            if points and points.are_squares and are_squares(self._context, points.screen.point_size, points.screen.size):
                arrays[program] = self._of_points(points, program)
            else:
                arrays[program] = self._array(mesh, program, self._buffer(mesh, (), lambda: mesh.triangles))
        return arrays[program]

    def _of_points(self, points: Points, program: Program) -> moderngl.VertexArray:
        """Returns the vertex array that draws points, in the mode POINTS."""
        gl, content = self._context.gl, []
        for name in program.attributes:
            if name in ATTRIBUTES:
                values = points.array(ATTRIBUTES[name][0])
                assert values is not None
                content.append((self._buffer_of(values), f"{ATTRIBUTES[name][1]}f", name))
        indices = None if points.order is None else gl.buffer(points.order)
        return gl.vertex_array(program.gl, content, indices, mode=moderngl.POINTS)

    def _buffer_of(self, values: NDArray[np.float32]) -> moderngl.Buffer:
        """Returns the buffer of an array, which is uploaded once and freed together with the array.

        The colours of points, unlike their places, are the same array for every view.
        """
        found = self._of_values.get(id(values))
        if found is None:
            found = self._of_values[id(values)] = self._context.gl.buffer(values)
            # The weak reference lets the buffers, and with them the context, go before the array does.
            weakref.finalize(values, _forget, weakref.ref(self), id(values)).atexit = False
        return found

    def _array(
        self, mesh: Mesh, program: Program, indices: moderngl.Buffer, further: tuple[Content, ...] = ()
    ) -> moderngl.VertexArray:
        names = tuple(name for name in program.attributes if name in ATTRIBUTES)
        sizes = [ATTRIBUTES[name][1] for name in names]
        buffer = self._buffer(mesh, names, lambda: _interleaved(mesh, names))
        layout = " ".join(f"{size}f" for size in sizes)
        return self._context.gl.vertex_array(program.gl, [(buffer, layout, *names), *further], indices)

    def _buffer(self, mesh: Mesh, key: tuple[str, ...], data: Callable[[], NDArray[Any]]) -> moderngl.Buffer:
        """Returns the cached buffer of a mesh. key: the attributes that it holds; empty for the buffer of triangles."""
        buffers = self._buffers.setdefault(mesh, {})
        if key not in buffers:
            buffers[key] = self._context.gl.buffer(data())
        return buffers[key]


def _forget(vertices: weakref.ref[Vertices], key: int) -> None:
    """Drops the buffer of an array that is gone. Do not call release(): moderngl's gc() frees the buffer."""
    found = vertices()
    if found is not None:
        found._of_values.pop(key, None)


def _interleaved(mesh: Mesh, names: tuple[str, ...]) -> NDArray[np.float32]:
    """Returns the attributes of a mesh, a row for each vertex, so that the data of one vertex lies together."""
    return np.hstack([getattr(mesh, ATTRIBUTES[name][0]) for name in names])
