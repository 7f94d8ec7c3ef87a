"""points: clouds of points, each of which becomes one pixel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import EYE, Array, Door, Hand, Pyrender, clip_from_world
from glshade.bench.works import BY_HAND, GLSHADE

# The side of the squares, as pyrender has it by default [pixels].
SIDE = 1


def cloud(count: int, number: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Returns (positions (N, 3), colours (N, 3)) of points on a shell about the origin; `number` chooses them."""
    random = np.random.default_rng(number)
    positions = random.normal(size=(count, 3))
    positions *= (1 + 0.1 * random.random((count, 1))) / np.linalg.norm(positions, axis=1, keepdims=True)
    return positions.astype(np.float32), (positions * 0.4 + 0.5).clip(0, 1).astype(np.float32)


class Cloud(Pyrender):
    """pyrender: one cloud, of which only the camera moves."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        self._node: Any = None
        self.show(cloud(size, 0))

    def show(self, points: tuple[Array, Array]) -> None:
        """Shows another cloud in place of the last one."""
        if self._node is not None:
            self.scene.remove_node(self._node)
        self._node = self.scene.add(self.pyrender.Mesh.from_points(*points))

    def renderers(self) -> Any:
        base = super().renderers()
        return lambda width, height: base(width, height, point_size=SIDE)

    def draw(self, prepared: Any) -> Array:
        self.look(prepared)
        return self.render()


class New(Cloud):
    """pyrender: a new cloud for each picture."""

    def prepare(self, number: int) -> Any:
        return cloud(self.size, number)

    def draw(self, prepared: Any) -> Array:
        self.show(prepared)
        return self.render()


class CloudDoor(Cloud, Door):
    """glshade.pyrender: one cloud."""


class NewDoor(New, Door):
    """glshade.pyrender: a new cloud for each picture."""


VERTEX = """\
#version 330
in vec3 position, tint;
out vec3 kd;
uniform mat4 clip_from_world;

void main() {
    kd = tint;
    gl_Position = clip_from_world * vec4(position, 1.0);
}
"""
FRAGMENT = """\
#version 330
in vec3 kd;
out vec4 colour;

void main() {
    colour = vec4(kd, 1.0);
}
"""


class ByHand(Hand):
    """moderngl: OpenGL's points in plain colours, without light."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        import moderngl

        self._points = moderngl.POINTS
        self.gl.point_size = SIDE
        self.program = self.gl.program(VERTEX, FRAGMENT)
        self._buffers = [self.gl.buffer(reserve=12 * size, dynamic=True) for _ in range(2)]
        content = [(self._buffers[0], "3f", "position"), (self._buffers[1], "3f", "tint")]
        self._cloud = self.gl.vertex_array(self.program, content)
        self.show(cloud(size, 0))

    def show(self, points: tuple[Array, Array]) -> None:
        """Shows another cloud in place of the last one."""
        for buffer, array in zip(self._buffers, points, strict=True):
            buffer.orphan()
            buffer.write(array)

    def look(self, position: Any, size: tuple[int, int] | None = None) -> None:
        clip = np.diag([1.0, -1.0, 1.0, 1.0]) @ clip_from_world(position)
        self.program["clip_from_world"].write(np.ascontiguousarray(clip.T, dtype="f4"))

    def draw(self, prepared: Any) -> Array:
        self.look(prepared)
        self.target.clear(0.0, 0.0, 0.0, 1.0)
        self._cloud.render(self._points)
        return self.read()


class NewByHand(ByHand):
    """moderngl: a new cloud for each picture, in the same buffers."""

    def prepare(self, number: int) -> Any:
        return cloud(self.size, number)

    def draw(self, prepared: Any) -> Array:
        self.show(prepared)
        return super().draw(EYE)


MOVED = {GLSHADE: CloudDoor, BY_HAND: ByHand, "pyrender": Cloud}
RENEWED = {GLSHADE: NewDoor, BY_HAND: NewByHand, "pyrender": New}
TARGETS = {"pyrender": 0.5}
WORKS = {
    "W14": LifeWork(
        "a cloud of 1,000,000 points by glshade.pyrender; the camera moves", "again", 1_000_000, 300, MOVED, TARGETS
    ),
    "W15": LifeWork("a new cloud of 200,000 points a picture by glshade.pyrender", "again", 200_000, 300, RENEWED, TARGETS),
}
