"""objects: thousands of objects that a Python program makes one by one, each with a material of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import MATERIAL, Array, Own, Pyrender, camera, grid, scene, sphere
from glshade.bench.works import GLSHADE

# Number of subdivisions of each sphere, which has 80 triangles.
SUBDIVISIONS = 1


def colour(place: Array) -> list[float]:
    """Returns the diffuse reflectance of the sphere at a place, which runs from red to green."""
    return [0.2 + 0.3 * (place[0] + 1), 0.2 + 0.3 * (place[1] + 1), 0.2]


class Native(Own):
    """glshade: an object for each sphere; they share one mesh. The first picture counts the making of the scene, too."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        from glshade.mesh.mesh import Mesh

        positions, triangles = sphere(SUBDIVISIONS)
        self._mesh = Mesh.build(positions, triangles, normals=positions)
        self._places = grid(size)
        self._scene: Any = None

    def draw(self, prepared: Any) -> Array:
        if self._scene is None:
            self._scene = scene([self._object(place) for place in self._places.tolist()])
        kind = type(self._scene.camera)
        moved = self._scene.through(kind.model_validate({"type": "perspective", **camera(prepared)}))
        return self.renderer.render(moved).pixels

    def _object(self, place: list[float]) -> dict[str, Any]:
        material = {**MATERIAL, "kd": colour(np.array(place))}
        return {"mesh": self._mesh, "material": material, "transform": {"translate": place[:3], "scale": place[3]}}


class Nodes(Pyrender):
    """pyrender: a node and a material for each sphere."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        self._arrays = sphere(SUBDIVISIONS)
        self._places = grid(size)
        self._made = False

    def draw(self, prepared: Any) -> Array:
        if not self._made:
            self._made = True
            for place in self._places:
                self._add(place)
        self.look(prepared)
        return self.render()

    def _add(self, place: Array) -> None:
        positions, triangles = self._arrays
        pose = np.diag([place[3], place[3], place[3], 1.0])
        pose[:3, 3] = place[:3]
        material = self.material(baseColorFactor=(*colour(place), 1.0))
        ball = self.pyrender.Primitive(positions=positions, normals=positions, indices=triangles, mode=4, material=material)
        self.scene.add(self.pyrender.Mesh([ball]), pose=pose)


FIRST = LifeWork(
    "10,000 objects with materials of their own, made in Python: the first picture",
    "first",
    size=10_000,
    small=9,
    programs={GLSHADE: Native, "pyrender": Nodes},
    limit=3.0,
    rounds=5,
    warm=0,
)
# pyrender draws so many objects one by one in a second or two, so it is left out where many pictures are drawn.
NEXT = replace(
    FIRST,
    what="the same objects: the next picture, from another camera",
    kind="again",
    programs={GLSHADE: Native},
    limit=0.15,
    warm=1,
)
LARGE = replace(
    FIRST,
    what="100,000 objects: the first picture",
    size=100_000,
    programs={GLSHADE: Native},
    limit=None,
    rounds=1,
    on_request=True,
)
WORKS = {"W12": FIRST, "W13": NEXT, "L1": LARGE}
