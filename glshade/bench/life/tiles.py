"""tiles: many small pictures of one scene through as many cameras, to one array."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import MATERIAL, Array, Hand, Own, Pyrender, camera, eye, scene, sphere
from glshade.bench.works import BY_HAND, GLSHADE

# The number of cameras, and the number of tiles in a row of the target that is written by hand.
CAMERAS, ACROSS = 64, 8
# Number of subdivisions of the sphere, which has 1,280 triangles.
SUBDIVISIONS = 3
# Name of the program by hand that draws all pictures into one target.
TILES = f"{BY_HAND} tiles"


def cameras(number: int) -> list[tuple[float, float, float]]:
    """Returns the positions of the cameras of a round, which are new in each round."""
    return [eye(CAMERAS * number + step + 1) for step in range(CAMERAS)]


class Native(Own):
    """glshade: Renderer.render_many."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        from glshade.mesh.mesh import Mesh

        positions, triangles = sphere(SUBDIVISIONS)
        mesh = Mesh.build(positions, triangles, normals=positions)
        self._scene = scene([{"mesh": mesh, "material": MATERIAL}], (size, size))

    def prepare(self, number: int) -> Any:
        kind = type(self._scene.camera)
        return [kind.model_validate({"type": "perspective", **camera(place)}) for place in cameras(number)]

    def draw(self, prepared: Any) -> Array:
        return self.renderer.render_many(self._scene, prepared)


class OneByOne(Hand):
    """moderngl: each picture is drawn into a target of its size, and read."""

    def __init__(self, size: int, folder: Path) -> None:
        self.pixels = self.tiled(size)
        super().__init__(size, folder)
        positions, triangles = sphere(SUBDIVISIONS)
        content = [(self.gl.buffer(positions), "3f", "position"), (self.gl.buffer(positions), "3f", "normal")]
        self._mesh = self.gl.vertex_array(self.program, content, self.gl.buffer(triangles))

    def tiled(self, size: int) -> tuple[int, int]:
        """Returns width and height of the target for pictures of a size [pixels]."""
        return size, size

    def prepare(self, number: int) -> Any:
        return cameras(number)

    def draw(self, prepared: Any) -> Array:
        pictures = np.empty((len(prepared), self.size, self.size, 3), dtype=np.uint8)
        for picture, position in zip(pictures, prepared, strict=True):
            self.look(position)
            self.target.clear(0.0, 0.0, 0.0, 1.0)
            self._mesh.render()
            picture[:] = self.read()[..., :3]
        return pictures


class Tiles(OneByOne):
    """moderngl: the pictures are tiles of one target, which is cleared and read once."""

    def tiled(self, size: int) -> tuple[int, int]:
        return ACROSS * size, CAMERAS // ACROSS * size

    def draw(self, prepared: Any) -> Array:
        side = self.size
        self.target.viewport = (0, 0, *self.pixels)
        self.target.clear(0.0, 0.0, 0.0, 1.0)
        for number, position in enumerate(prepared):
            self.look(position, (side, side))
            self.target.viewport = (number % ACROSS * side, number // ACROSS * side, side, side)
            self._mesh.render()
        self.target.viewport = (0, 0, *self.pixels)
        tiles = self.read().reshape(-1, side, ACROSS, side, 4)[..., :3]
        return np.ascontiguousarray(tiles.transpose(0, 2, 1, 3, 4)).reshape(-1, side, side, 3)


class Turned(Pyrender):
    """pyrender: one picture after another."""

    def __init__(self, size: int, folder: Path) -> None:
        self.pixels = (size, size)
        super().__init__(size, folder)
        positions, triangles = sphere(SUBDIVISIONS)
        make = partial(self.pyrender.Primitive, positions=positions, normals=positions, indices=triangles, mode=4)
        self.scene.add(self.pyrender.Mesh([make(material=self.material())]))

    def prepare(self, number: int) -> Any:
        return cameras(number)

    def draw(self, prepared: Any) -> Array:
        pictures = []
        for position in prepared:
            self.look(position)
            pictures.append(self.render())
        return np.stack(pictures)


PROGRAMS = {GLSHADE: Native, BY_HAND: OneByOne, TILES: Tiles, "pyrender": Turned}
TARGETS = {TILES: 1.2}
WORKS = {
    "W10": LifeWork("64 cameras of 64x64 pixels, one scene, to one array", "again", 64, 16, PROGRAMS, TARGETS),
    "W11": LifeWork("64 cameras of 128x128 pixels, one scene, to one array", "again", 128, 16, PROGRAMS, TARGETS),
}
