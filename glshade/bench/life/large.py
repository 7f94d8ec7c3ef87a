"""large: the first picture of millions of triangles, and of a picture of millions of pixels."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import EYE, MATERIAL, Array, Hand, Own, Pyrender, scene, sphere, terrain
from glshade.bench.works import BY_HAND, GLSHADE


class Arrays:
    """The arrays of a work, which its programs read before their time begins."""

    size: int
    folder: Path

    def prepare(self, number: int) -> Any:
        """Returns (positions (V, 3) float32, triangles (T, 3) uint32), read from the work's file."""
        with np.load(self.folder / "arrays.npz") as file:
            return file["positions"], file["triangles"]


def written(make: Any, size: int, folder: Path) -> None:
    """Writes the arrays that `make` returns for a size."""
    positions, triangles = make(size)
    np.savez(folder / "arrays.npz", positions=positions, triangles=triangles)


class Bare(Arrays, Own):
    """glshade: vertices and triangles without normals, which glshade computes."""

    def draw(self, prepared: Any) -> Array:
        from glshade.mesh.mesh import Mesh

        return self.renderer.render(scene([{"mesh": Mesh.build(*prepared), "material": MATERIAL}])).pixels


class Normals(Arrays, Own):
    """glshade: a sphere with normals, of which only the side that faces the camera is drawn."""

    def draw(self, prepared: Any) -> Array:
        from glshade.mesh.mesh import Mesh

        positions, triangles = prepared
        ball = {"mesh": Mesh.build(positions, triangles, normals=positions), "material": MATERIAL}
        return self.renderer.render(scene([ball])).pixels


class BareTrimesh(Arrays, Pyrender):
    """pyrender: a trimesh, which computes the normals of its vertices."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        import trimesh

        self._trimesh = trimesh

    def draw(self, prepared: Any) -> Array:
        positions, triangles = prepared
        body = self._trimesh.Trimesh(positions, triangles, process=False)
        self.scene.add(self.pyrender.Mesh.from_trimesh(body, material=self.material(), smooth=True))
        return self.render()


class NormalsPyrender(Arrays, Pyrender):
    """pyrender: a sphere with normals."""

    def draw(self, prepared: Any) -> Array:
        positions, triangles = prepared
        make = partial(self.pyrender.Primitive, positions=positions, normals=positions, indices=triangles, mode=4)
        self.scene.add(self.pyrender.Mesh([make(material=self.material())]))
        return self.render()


class NormalsByHand(Arrays, Hand):
    """moderngl: a sphere with normals, in two buffers."""

    def draw(self, prepared: Any) -> Array:
        positions, triangles = prepared
        gl = self.gl
        content = [(gl.buffer(positions), "3f", "position"), (gl.buffer(positions), "3f", "normal")]
        mesh = gl.vertex_array(self.program, content, gl.buffer(triangles))
        self.look(EYE)
        self.target.clear(0.0, 0.0, 0.0, 1.0)
        mesh.render()
        return self.read()


class BareVtk(Arrays):
    """VTK: vtkPolyDataNormals computes the normals."""

    driver: str | None = None

    def __init__(self, size: int, folder: Path) -> None:
        from glshade.bench.life._vtk import Window

        self.size, self.folder, self._window = size, folder, Window

    def draw(self, prepared: Any) -> Array:
        window = self._window((512, 512))
        window.mesh(*prepared)
        pixels = window.draw()
        self.driver = window.driver
        return pixels


class Wide(Own):
    """glshade: a picture of `size` x `size` pixels."""

    def draw(self, prepared: Any) -> Array:
        return self.renderer.render(scene([{"shape": "sphere", "material": MATERIAL}], (self.size, self.size))).pixels


FROM_ARRAYS = LifeWork(
    "2.6 million triangles from arrays without normals: the first picture",
    "first",
    # Width and height of the terrain [vertices].
    size=1141,
    small=9,
    programs={GLSHADE: Bare, "pyrender": BareTrimesh, "vtk": BareVtk},
    limit=5.0,
    rounds=5,
    warm=0,
    set_up=partial(written, terrain),
)
WITH_NORMALS = LifeWork(
    "5.2 million triangles with normals: the first picture",
    "first",
    # Number of subdivisions of the sphere.
    size=9,
    small=2,
    programs={GLSHADE: Normals, BY_HAND: NormalsByHand, "pyrender": NormalsPyrender},
    targets={"pyrender": 0.7},
    rounds=5,
    warm=0,
    set_up=partial(written, sphere),
)
LARGER = replace(
    WITH_NORMALS,
    what="21 million triangles with normals: the first picture",
    size=10,
    programs={GLSHADE: Normals},
    targets={},
    rounds=1,
    on_request=True,
)
WIDE = LifeWork("a picture of 16,384x16,384 pixels", "first", 16_384, 64, {GLSHADE: Wide}, rounds=1, warm=0, on_request=True)
WORKS = {"W16": FROM_ARRAYS, "W17": WITH_NORMALS, "L2": LARGER, "L3": WIDE}
