"""Textures on the GPU: float32 and linear, so that filtering is exact to float and sRGB is decoded before it is averaged."""

from __future__ import annotations

import ctypes

import moderngl

from glshade.gl.context import GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, Context
from glshade.textures.mipmap import levels
from glshade.textures.texels import Texels

WRAP = {"repeat": 0x2901, "clamp": 0x812F, "mirror": 0x8370}


def upload(context: Context, texels: Texels) -> moderngl.Texture:
    """The texture, trilinear, with its wrap modes. Errors: AssetError."""
    chain = list(levels(texels.read()))
    while max(chain[0].shape[:2]) > context.largest_side:
        chain.pop(0)
    height, width, _ = chain[0].shape
    result = context.gl.texture((width, height), 4, chain[0].tobytes(), dtype="f4")
    result.build_mipmaps()
    for level, pixels in enumerate(chain[1:], 1):
        result.write(pixels.tobytes(), level=level)
    result.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    result.repeat_x, result.repeat_y = (mode != "clamp" for mode in texels.wrap)
    if "mirror" in texels.wrap:
        _mirror(context, result, texels.wrap)
    return result


def _mirror(context: Context, texture: moderngl.Texture, wrap: tuple[str, str]) -> None:
    """moderngl knows repeat and clamp alone."""
    parameter = context.procedure("glTexParameteri", None, ctypes.c_uint, ctypes.c_uint, ctypes.c_int)
    if parameter is not None:
        texture.use(0)
        # moderngl binds on the default unit when it makes a texture, and leaves the active unit at the one it used last.
        for axis, mode in zip((GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T), wrap, strict=True):
            parameter(GL_TEXTURE_2D, axis, WRAP[mode])
