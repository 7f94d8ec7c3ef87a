"""Textures: uploads pictures to the GPU as linear float32, so that filtering has float precision and averages linear values."""

from __future__ import annotations

import ctypes

import moderngl

from glshade.gl.context import GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, Context
from glshade.textures.mipmap import levels
from glshade.textures.texels import Texels

# Wrap mode -> value in Khronos' registry (gl.xml).
WRAP = {"repeat": 0x2901, "clamp": 0x812F, "mirror": 0x8370}


def upload(context: Context, texels: Texels) -> moderngl.Texture:
    """A texture with trilinear filtering. Levels that are larger than the driver allows are left out.

    context: the context, which must be current.
    texels: the picture and its wrap modes.
    Errors: AssetError.
    """
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
    """Sets the wrap modes of a texture through OpenGL, because moderngl has no mirrored repeat."""
    parameter = context.procedure("glTexParameteri", None, ctypes.c_uint, ctypes.c_uint, ctypes.c_int)
    if parameter is not None:
        # glTexParameteri changes the texture that is bound to the active unit.
        texture.use(0)
        for axis, mode in zip((GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T), wrap, strict=True):
            parameter(GL_TEXTURE_2D, axis, WRAP[mode])
