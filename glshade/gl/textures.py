"""Textures: uploads pictures to the GPU with their mipmaps, in the formats of `glshade.textures.storage`."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.gl.context import GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, Context
from glshade.textures.storage import Stored
from glshade.textures.texels import Texels

# Wrap mode -> value in Khronos' registry (gl.xml).
WRAP = {"repeat": 0x2901, "clamp": 0x812F, "mirror": 0x8370}

# Khronos' registry values (gl.xml).
GL_RGBA, GL_RED, GL_RG, GL_RGB, GL_UNPACK_ALIGNMENT = 0x1908, 0x1903, 0x8227, 0x1907, 0x0CF5
GL_UNSIGNED_BYTE, GL_UNSIGNED_SHORT, GL_FLOAT = 0x1401, 0x1403, 0x1406
GL_UNSIGNED_INT_2_10_10_10_REV = 0x8368
# OpenGL's name of a format -> (its value, the type of the numbers that are uploaded, the bytes of a texel on the GPU).
FORMATS: Mapping[str, tuple[int, int, int]] = {
    "SRGB8_ALPHA8": (0x8C43, GL_UNSIGNED_BYTE, 4),
    "R16": (0x822A, GL_UNSIGNED_SHORT, 2),
    "RG16": (0x822C, GL_UNSIGNED_SHORT, 4),
    "RGBA16": (0x805B, GL_UNSIGNED_SHORT, 8),
    "RGB10_A2": (0x8059, GL_UNSIGNED_INT_2_10_10_10_REV, 4),
    "R32F": (0x822E, GL_FLOAT, 4),
    "RG32F": (0x8230, GL_FLOAT, 8),
    "RGBA32F": (0x8814, GL_FLOAT, 16),
}
# Number of stored channels -> OpenGL's name of their order.
CHANNELS = {1: GL_RED, 2: GL_RG, 3: GL_RGB, 4: GL_RGBA}


def upload(context: Context, texels: Texels) -> moderngl.Texture:
    """Returns a texture with trilinear filtering, or with the nearest texel of a magnified picture where the texels ask for it.

    Levels that are larger than the driver allows are left out.

    context: the context, which must be current.
    texels: the picture, its wrap modes and its filter.
    Errors: AssetError.
    """
    stored = texels.read()
    while max(stored.levels[0].shape[:2]) > context.largest_side:
        stored = replace(stored, levels=stored.levels[1:])
    result = mipmapped(context, stored)
    if texels.filter == "nearest":
        result.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.NEAREST)
    result.repeat_x, result.repeat_y = (mode != "clamp" for mode in texels.wrap)
    if "mirror" in texels.wrap:
        _mirror(context, result, texels.wrap)
    return result


def mipmapped(context: Context, stored: Stored) -> moderngl.Texture:
    """Returns a repeating texture with trilinear filtering. The size of all its levels is in `extra` [bytes].

    context: the context, which must be current.
    stored: the picture with its mipmaps.
    """
    types = (*[ctypes.c_uint] * 2, *[ctypes.c_int] * 4, *[ctypes.c_uint] * 2, ctypes.c_void_p)
    define = context.procedure("glTexImage2D", None, *types)
    align = context.procedure("glPixelStorei", None, ctypes.c_uint, ctypes.c_int)
    if define is None or align is None:
        return _mipmapped_by_moderngl(context, list(stored.decoded()))
    internal, numbers, texel = FORMATS[stored.format.name]
    # The texture gets its size and its format with its levels.
    result = context.gl.texture((1, 1), 4, dtype="f1")
    # glTexImage2D changes the texture that is bound to the active unit. moderngl reserves a unit for such calls.
    result.use(context.gl.default_texture_unit)
    # Rows of texels follow each other without gaps.
    align(GL_UNPACK_ALIGNMENT, 1)
    order = GL_RGBA if numbers == GL_UNSIGNED_INT_2_10_10_10_REV else CHANNELS[stored.format.channels]
    for level, texels in enumerate(stored.levels):
        rows = np.ascontiguousarray(texels)
        height, width = rows.shape[:2]
        define(GL_TEXTURE_2D, level, internal, width, height, 0, order, numbers, rows.ctypes.data)
    result.swizzle = stored.swizzle
    result.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    result.extra = sum(level.shape[0] * level.shape[1] for level in stored.levels) * texel
    return result


def _mipmapped_by_moderngl(context: Context, chain: Sequence[NDArray[np.float32]]) -> moderngl.Texture:
    """Returns the texture of decoded levels (h, w, 4) in float32, for contexts that cannot look up functions.

    moderngl writes only to levels that exist, and makes them by drawing them. Compiling the driver's program for that takes
    80 ms on llvmpipe.
    """
    height, width, _ = chain[0].shape
    result = context.gl.texture((width, height), 4, chain[0].tobytes(), dtype="f4")
    result.build_mipmaps()
    for level, pixels in enumerate(chain[1:], 1):
        result.write(pixels.tobytes(), level=level)
    result.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    result.extra = sum(level.nbytes for level in chain)
    return result


def show_texels(texture: moderngl.Texture) -> None:
    """Lets a texture show the nearest texel of its largest level, without filtering."""
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)


def _mirror(context: Context, texture: moderngl.Texture, wrap: tuple[str, str]) -> None:
    """Sets the wrap modes of a texture through OpenGL, because moderngl has no mirrored repeat."""
    parameter = context.procedure("glTexParameteri", None, ctypes.c_uint, ctypes.c_uint, ctypes.c_int)
    if parameter is not None:
        # glTexParameteri changes the texture that is bound to the active unit.
        texture.use(0)
        for axis, mode in zip((GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T), wrap, strict=True):
            parameter(GL_TEXTURE_2D, axis, WRAP[mode])
