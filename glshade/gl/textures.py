"""Textures: uploads pictures to the GPU as linear float32, so that filtering has float precision and averages linear values."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.gl.context import GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, Context
from glshade.textures.mipmap import levels
from glshade.textures.texels import Texels

# Wrap mode -> value in Khronos' registry (gl.xml).
WRAP = {"repeat": 0x2901, "clamp": 0x812F, "mirror": 0x8370}

# Khronos' registry values (gl.xml).
GL_RGBA32F, GL_RGBA, GL_FLOAT = 0x8814, 0x1908, 0x1406


def upload(context: Context, texels: Texels) -> moderngl.Texture:
    """Returns a texture with trilinear filtering, or with the nearest texel of a magnified picture where the texels ask for it.

    Levels that are larger than the driver allows are left out.

    context: the context, which must be current.
    texels: the picture, its wrap modes and its filter.
    Errors: AssetError.
    """
    chain = list(levels(texels.read()))
    while max(chain[0].shape[:2]) > context.largest_side:
        chain.pop(0)
    result = mipmapped(context, chain)
    if texels.filter == "nearest":
        result.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.NEAREST)
    result.repeat_x, result.repeat_y = (mode != "clamp" for mode in texels.wrap)
    if "mirror" in texels.wrap:
        _mirror(context, result, texels.wrap)
    return result


def mipmapped(context: Context, chain: Sequence[NDArray[np.float32]]) -> moderngl.Texture:
    """Returns a repeating texture with trilinear filtering.

    context: the context, which must be current.
    chain: the pixels (h, w, 4) of all levels, from the largest to the one of a single pixel.
    """
    height, width, _ = chain[0].shape
    result = context.gl.texture((width, height), 4, chain[0].tobytes(), dtype="f4")
    _add_levels(context, result, chain[1:])
    result.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    return result


def _add_levels(context: Context, texture: moderngl.Texture, chain: Sequence[NDArray[np.float32]]) -> None:
    """Uploads the levels of a texture that follow its largest one."""
    types = (*[ctypes.c_uint] * 2, *[ctypes.c_int] * 4, *[ctypes.c_uint] * 2, ctypes.c_char_p)
    define = context.procedure("glTexImage2D", None, *types)
    if define is None:
        # moderngl writes only to levels that exist, and makes them by drawing them. Compiling the driver's program for that
        # takes 80 ms on llvmpipe.
        texture.build_mipmaps()
        for level, pixels in enumerate(chain, 1):
            texture.write(pixels.tobytes(), level=level)
        return
    # glTexImage2D changes the texture that is bound to the active unit. moderngl reserves a unit for such calls.
    texture.use(context.gl.default_texture_unit)
    for level, pixels in enumerate(chain, 1):
        height, width, _ = pixels.shape
        define(GL_TEXTURE_2D, level, GL_RGBA32F, width, height, 0, GL_RGBA, GL_FLOAT, pixels.tobytes())


def _mirror(context: Context, texture: moderngl.Texture, wrap: tuple[str, str]) -> None:
    """Sets the wrap modes of a texture through OpenGL, because moderngl has no mirrored repeat."""
    parameter = context.procedure("glTexParameteri", None, ctypes.c_uint, ctypes.c_uint, ctypes.c_int)
    if parameter is not None:
        # glTexParameteri changes the texture that is bound to the active unit.
        texture.use(0)
        for axis, mode in zip((GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T), wrap, strict=True):
            parameter(GL_TEXTURE_2D, axis, WRAP[mode])
