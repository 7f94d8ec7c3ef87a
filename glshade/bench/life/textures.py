"""textures: each picture shows one model with a new texture, as data sets of textured models do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import EYE, MATERIAL, Array, Door, Hand, Own, Pyrender, scene, sphere
from glshade.bench.works import BY_HAND, DOOR, GLSHADE

# Number of subdivisions of the sphere, which has 20,480 triangles.
SUBDIVISIONS = 5
# OpenGL's name of 8-bit texels that are decoded from sRGB (gl.xml).
SRGB8 = 0x8C41


def uvs(positions: Array) -> NDArray[np.float32]:
    """Returns texture coordinates (V, 2): the front of the sphere, projected along the view axis."""
    return np.ascontiguousarray(positions[:, :2] * 0.5 + 0.5, dtype=np.float32)


def texture(side: int, number: int) -> NDArray[np.uint8]:
    """Returns a new array of waves of three colours, (side, side, 3); `number` moves the waves."""
    steps = np.arange(side) / side * 40 + number
    waves = np.stack([np.sin(steps * (1 + channel / 2)) for channel in range(3)], axis=-1)
    pixels: NDArray[np.uint8] = ((waves[:, None] * waves[None, ::-1] * 0.5 + 0.5) * 200 + 20).astype(np.uint8)
    return pixels


class Native(Own):
    """glshade: a scene for each texture."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        from glshade.mesh.mesh import Mesh

        positions, triangles = sphere(SUBDIVISIONS)
        self._mesh = Mesh.build(positions, triangles, normals=positions, uvs=uvs(positions))

    def prepare(self, number: int) -> Any:
        return texture(self.size, number)

    def draw(self, prepared: Any) -> Array:
        material = {**MATERIAL, "kd": {"texture": prepared}, "ka": 0.0}
        return self.renderer.render(scene([{"mesh": self._mesh, "material": material}])).pixels


class Textured(Pyrender):
    """pyrender: the mesh gets a new material for each texture."""

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        positions, triangles = sphere(SUBDIVISIONS)
        self._primitive = self.pyrender.Primitive(
            positions=positions, normals=positions, texcoord_0=uvs(positions), indices=triangles, mode=4
        )
        self.scene.ambient_light = np.zeros(3)
        self.scene.add(self.pyrender.Mesh([self._primitive]))

    def prepare(self, number: int) -> Any:
        return texture(self.size, number)

    def draw(self, prepared: Any) -> Array:
        picture = self.pyrender.Texture(source=prepared, source_channels="RGB")
        self._primitive.material = self.material(baseColorTexture=picture, baseColorFactor=(1.0, 1.0, 1.0, 1.0))
        return self.render()


class TexturedDoor(Textured, Door):
    """glshade.pyrender: the same."""


class ByHand(Hand):
    """moderngl: the texture is decoded from sRGB by the GPU, has mipmaps, and is filtered trilinearly."""

    kd = "texture(picture, t).rgb"
    ambient = 0.0

    def __init__(self, size: int, folder: Path) -> None:
        super().__init__(size, folder)
        import moderngl

        positions, triangles = sphere(SUBDIVISIONS)
        gl = self.gl
        buffers = [(gl.buffer(positions), "3f", "position"), (gl.buffer(positions), "3f", "normal")]
        buffers.append((gl.buffer(uvs(positions)), "2f", "uv"))
        self._mesh = gl.vertex_array(self.program, buffers, gl.buffer(triangles))
        self._filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        self.look(EYE)

    def prepare(self, number: int) -> Any:
        return texture(self.size, number)

    def draw(self, prepared: Any) -> Array:
        # Row 0 of an array is the top of a picture, and v = 0 its bottom.
        data = np.ascontiguousarray(prepared[::-1])
        picture = self.gl.texture((self.size, self.size), 3, data, alignment=1, internal_format=SRGB8)
        picture.build_mipmaps()
        picture.filter = self._filter
        picture.use(0)
        self.target.clear(0.0, 0.0, 0.0, 1.0)
        self._mesh.render()
        pixels = self.read()
        picture.release()
        return pixels


PROGRAMS = {GLSHADE: Native, DOOR: TexturedDoor, BY_HAND: ByHand, "pyrender": Textured}
WORKS = {
    "W6": LifeWork("a new texture of 1024x1024 a picture", "again", 1024, 64, PROGRAMS, {"pyrender": 0.8}),
    "W7": LifeWork("a new texture of 2048x2048 a picture", "again", 2048, 64, PROGRAMS, {"pyrender": 0.8}),
}
