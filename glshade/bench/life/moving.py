"""moving: a video of a body whose vertices all move from picture to picture, while its triangles stay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import EYE, MATERIAL, Array, Door, Hand, Own, Pyrender, scene, sphere
from glshade.bench.works import BY_HAND, DOOR, GLSHADE

# The size of the video's pictures [pixels], and the samples of a pixel.
PIXELS, SAMPLES = (640, 480), 4


def moved(positions: Array, number: int) -> NDArray[np.float32]:
    """Returns the positions (V, 3) of picture `number`: waves run over the body."""
    waves = 1 + 0.1 * np.sin(6 * positions[:, 1:2] + 0.3 * number) * np.cos(4 * positions[:, 0:1])
    return np.ascontiguousarray(positions * waves, dtype=np.float32)


class Native(Own):
    """glshade: a mesh for each picture, without normals, which glshade computes."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        self._positions, self._triangles = sphere(size)

    def prepare(self, number: int) -> Any:
        return moved(self._positions, number)

    def draw(self, prepared: Any) -> Array:
        from glshade.mesh.mesh import Mesh

        body = {"mesh": Mesh.build(prepared, self._triangles), "material": MATERIAL}
        return self.renderer.render(scene([body], PIXELS, SAMPLES)).pixels


class Moving(Pyrender):
    """pyrender: a trimesh for each picture, whose vertex normals trimesh computes."""

    pixels = PIXELS

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        import trimesh

        self._trimesh = trimesh
        self._positions, self._triangles = sphere(size)
        self._node: Any = None

    def prepare(self, number: int) -> Any:
        return moved(self._positions, number)

    def draw(self, prepared: Any) -> Array:
        body = self._trimesh.Trimesh(prepared, self._triangles, process=False)
        if self._node is not None:
            self.scene.remove_node(self._node)
        self._node = self.scene.add(self.pyrender.Mesh.from_trimesh(body, material=self.material(), smooth=True))
        return self.render()


class MovingDoor(Moving, Door):
    """glshade.pyrender: the same."""


class ByHand(Hand):
    """moderngl: the buffers are written anew; normals by one product with a sparse matrix, which is made once."""

    pixels, samples = PIXELS, SAMPLES

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        from scipy.sparse import csr_matrix

        self._positions, triangles = sphere(size)
        self._triangles = triangles.astype(np.int64)
        corners = self._triangles.ravel(), np.arange(triangles.size) // 3
        shape = len(self._positions), len(triangles)
        # Row v of the matrix sums the area vectors of the triangles around the vertex v.
        self._sum = csr_matrix((np.ones(triangles.size, dtype=np.float32), corners), shape)
        self._buffer = self.gl.buffer(reserve=24 * len(self._positions), dynamic=True)
        content = [(self._buffer, "3f 3f", "position", "normal")]
        self._mesh = self.gl.vertex_array(self.program, content, self.gl.buffer(triangles))
        self.look(EYE)

    def prepare(self, number: int) -> Any:
        return moved(self._positions, number)

    def draw(self, prepared: Any) -> Array:
        a, b, c = (prepared[self._triangles[:, corner]] for corner in range(3))
        normals = self._sum @ np.cross(b - a, c - a)
        self._buffer.orphan()
        self._buffer.write(np.hstack([prepared, normals]).astype(np.float32, copy=False))
        self.target.clear(0.0, 0.0, 0.0, 1.0)
        self._mesh.render()
        return self.read()


class Vtk:
    """VTK: the points of one vtkPolyData are replaced; vtkPolyDataNormals computes the normals."""

    driver: str | None = None

    def __init__(self, size: int, folder: Path) -> None:
        from glshade.bench.life._vtk import Window

        self._positions, triangles = sphere(size)
        self._window = Window(PIXELS, SAMPLES)
        self._body = self._window.mesh(self._positions, triangles)

    def prepare(self, number: int) -> Any:
        return moved(self._positions, number)

    def draw(self, prepared: Any) -> Array:
        self._body.move(prepared)
        pixels = self._window.draw()
        self.driver = self._window.driver
        return pixels


PROGRAMS = {GLSHADE: Native, DOOR: MovingDoor, BY_HAND: ByHand, "pyrender": Moving, "vtk": Vtk}
WORKS = {
    "W8": LifeWork(
        "a body of 10,242 vertices that all move, 640x480 pixels with 4 samples",
        "again",
        size=5,
        small=2,
        programs=PROGRAMS,
        targets={BY_HAND: 1.4, "pyrender": 0.5},
    )
}
