"""Resources: the LRU caches of one context, for programs, textures, frames and pixel arrays."""

from __future__ import annotations

import sys
import weakref
from collections.abc import Hashable
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.gl.context import Context
from glshade.gl.frame import FORMATS, Frame, Storage
from glshade.gl.program import Program
from glshade.gl.tables import TEXEL, upload_table
from glshade.gl.textures import upload
from glshade.gl.vertices import Vertices
from glshade.glsl.flat_inputs import with_flat_inputs
from glshade.glsl.instancing import with_instances
from glshade.glsl.source import Source
from glshade.lru import Lru
from glshade.textures.pixel_array import PixelArray
from glshade.textures.texels import Texels
from glshade.textures.volume import Volume

# A program takes about this much memory [bytes]. llvmpipe keeps the machine code of each of its variants: 0.7 MiB were measured
# with one light, and 3.6 MiB with eight.
PROGRAM = 2 << 20
# The limit of the cache of programs [bytes].
PROGRAMS = 192 << 20
# The limit of the cache of textures [bytes]. An 8-bit colour texture of 1024 x 1024 texels takes 5.3 MiB with its mipmaps.
TEXTURES = 96 << 20
# The limit of the cache of frames [bytes].
FRAMES = 256 << 20
# The number of frames that are never evicted: a frame in linear light and the one that it is encoded into are used together.
FRAMES_IN_USE = 2


class Resources:
    """The cached objects of one context. An evicted object stays alive as long as other code refers to it.

    No method calls release(): moderngl's gc() frees an object once its last reference has gone, and fails if both happen.

    context: the OpenGL context of the objects.
    vertices: the buffers of the meshes.
    """

    def __init__(self, context: Context) -> None:
        self.context = context
        self.vertices = Vertices(context)
        self._programs: Lru[tuple[tuple[str, ...], bool, tuple[str, ...]], Program] = Lru(PROGRAMS)
        self._textures: Lru[Hashable, moderngl.Texture | moderngl.Texture3D] = Lru(TEXTURES)
        self._frames: Lru[tuple[tuple[int, int], Storage, int, int], Frame] = Lru(FRAMES, spare=FRAMES_IN_USE)
        self._pixels: list[NDArray[Any]] = []

    def program(self, source: Source, flat: bool = False, varying: tuple[str, ...] = ()) -> Program:
        """Returns the compiled program of a source. Sources that differ only in comments share one program.

        source: the text of the program.
        flat: whether the fragment stage gets flat inputs in place of uniforms; the pictures are the same.
        varying: the uniforms that become attributes of the instances; empty for a program that draws one instance.
        Errors: ShaderError.
        """

        def make() -> Program:
            written = with_instances(source, varying) if varying else source
            written = with_flat_inputs(written, self.context.passed_vectors) if flat else written
            return Program(self.context, written)

        return self._programs.find((source.code, flat, varying), make, lambda _: PROGRAM)

    def age(self) -> None:
        """Marks all programs, textures and frames as unused. Those that later pictures need count as used again."""
        for cache in self._caches:
            cache.age()

    def evict_unused(self) -> None:
        """Evicts the programs, textures and frames that no picture has needed since the last call of `age`."""
        for cache in self._caches:
            cache.evict_unused()

    @property
    def _caches(self) -> tuple[Lru[Any, Any], ...]:
        return self._programs, self._textures, self._frames

    def texture(self, texels: Texels | Volume) -> moderngl.Texture | moderngl.Texture3D:
        """Returns the texture of a picture or of a table, from the cache if possible.

        The texture of a file is made again if the file has changed. That of an array is evicted when the array is freed.
        Errors: AssetError, SceneError.
        """
        if isinstance(texels, Volume):
            table = texels
            return self._textures.find(("table", table.digest), lambda: upload_table(self.context, table), texture_size)
        key = texels.key

        def make() -> moderngl.Texture:
            if isinstance(texels.source, PixelArray):
                # The weak reference lets the cache, and with it the context, go before the picture does.
                weakref.finalize(texels.source, _drop, weakref.ref(self._textures), key).atexit = False
            return upload(self.context, texels)

        return self._textures.find(key, make, texture_size)

    def frame(self, size: tuple[int, int], storage: Storage, samples: int, number: int = 0) -> Frame:
        """Returns a frame to draw into, which may hold an earlier picture.

        size: width and height [pixels].
        storage: the format of the colours.
        samples: the number of samples per pixel.
        number: tells apart several frames of one kind that are used together.
        """
        key = size, storage, samples, number
        return self._frames.find(key, lambda: Frame(self.context, size, storage, samples), frame_size)

    def pixels(self, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """Returns an uninitialised array for a picture. An earlier array is reused if no image refers to it, because a new one
        takes longer to fill."""
        for array, references in zip(self._pixels, _references(self._pixels), strict=True):
            if references == FREE and array.shape == shape and array.dtype == dtype:
                return array
        self._pixels = [*self._pixels[-1:], np.empty(shape, dtype=dtype)]
        return self._pixels[-1]


def frame_size(frame: Frame) -> int:
    """Returns the approximate size of a frame [bytes]."""
    width, height = frame.size
    channels, samples = FORMATS[frame.storage][1], frame.samples
    # Every sample has colours and depth of 4 bytes per number; several samples are resolved to another buffer.
    return width * height * (samples * (channels * 4 + 4) + (channels * 4 if samples > 1 else 0))


def _drop(cache: weakref.ref[Lru[Hashable, Any]], key: Hashable) -> None:
    """Removes a key from a cache that may be gone already."""
    found = cache()
    if found is not None:
        found.drop(key)


def texture_size(texture: moderngl.Texture | moderngl.Texture3D) -> int:
    """Returns the size of a texture with its mipmaps [bytes]."""
    if isinstance(texture, moderngl.Texture3D):
        return texture.width * texture.height * texture.depth * TEXEL
    # glshade.gl.textures leaves the size there.
    return int(texture.extra)


def _references(arrays: list[NDArray[Any]]) -> list[int]:
    """Returns the number of references to each array, including those of the list and of this function."""
    return [sys.getrefcount(array) for array in arrays]


# The result of _references for an array that only the list refers to; it differs between versions of Python.
FREE = _references([np.empty(0)])[0]
