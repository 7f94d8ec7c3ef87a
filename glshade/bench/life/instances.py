"""instances: 10,000 spheres that share one mesh, of which only the camera moves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import MATERIAL, Array, Door, Hand, Own, Pyrender, camera, grid, scene, sphere
from glshade.bench.works import BY_HAND, DOOR, GLSHADE

# Number of subdivisions of each sphere, which has 80 triangles.
SUBDIVISIONS = 1


def poses(count: int) -> Array:
    """Returns the matrices (N, 4, 4) that place the spheres."""
    result, places = np.tile(np.eye(4), (count, 1, 1)), grid(count)
    result[:, :3, :3] *= places[:, 3, None, None]
    result[:, :3, 3] = places[:, :3]
    return result


class Native(Own):
    """glshade: one object with 10,000 copies of a mesh."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        from glshade.mesh.copies import Copies
        from glshade.mesh.mesh import Mesh

        positions, triangles = sphere(SUBDIVISIONS)
        mesh = Mesh.build(positions, triangles, normals=positions)
        self._scene = scene([{"mesh": Copies.build(mesh, poses(size)), "material": MATERIAL}])
        self._camera = type(self._scene.camera).model_validate

    def draw(self, prepared: Any) -> Array:
        moved = self._scene.through(self._camera({"type": "perspective", **camera(prepared)}))
        return self.renderer.render(moved).pixels


class Posed(Pyrender):
    """pyrender: one mesh with 10,000 poses."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        positions, triangles = sphere(SUBDIVISIONS)
        shared = {"positions": positions, "normals": positions, "indices": triangles, "mode": 4}
        ball = self.pyrender.Primitive(**shared, material=self.material(), poses=poses(size))
        self.scene.add(self.pyrender.Mesh([ball]))

    def draw(self, prepared: Any) -> Array:
        self.look(prepared)
        return self.render()


class PosedDoor(Posed, Door):
    """glshade.pyrender: the same."""


class ByHand(Hand):
    """moderngl: one instanced draw, with the places as attributes of the instances."""

    placed = "* place.w + place.xyz"

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        positions, triangles = sphere(SUBDIVISIONS)
        gl, places = self.gl, np.ascontiguousarray(grid(size), dtype=np.float32)
        content = [(gl.buffer(positions), "3f", "position"), (gl.buffer(positions), "3f", "normal")]
        content.append((gl.buffer(places), "4f/i", "place"))
        self._mesh = gl.vertex_array(self.program, content, gl.buffer(triangles))

    def draw(self, prepared: Any) -> Array:
        self.look(prepared)
        self.target.clear(0.0, 0.0, 0.0, 1.0)
        self._mesh.render(instances=self.size)
        return self.read()


PROGRAMS = {GLSHADE: Native, DOOR: PosedDoor, BY_HAND: ByHand, "pyrender": Posed}
WORKS = {
    "W9": LifeWork("10,000 instances of one mesh; the camera moves", "again", 10_000, 9, PROGRAMS, {"pyrender": 0.3}),
}
