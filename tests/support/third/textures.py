"""Textures: pictures that are read at texture coordinates, between the four nearest texels and without mipmaps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
import OpenImageIO
from support.third.vectors import Array, unit


@cache
def _stored(path: str) -> Array:
    """Returns a picture of 8 bits (H, W, 3) as float32 numbers from 0 to 1. Row 0 is the bottom row."""
    pixels: Array = OpenImageIO.ImageBuf(path).get_pixels(OpenImageIO.FLOAT)
    return pixels[::-1]


def decoded(x: Array) -> Array:
    """Returns the linear values of sRGB-encoded ones, IEC 61966-2-1, with the precision of x."""
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def _wraps(texture: Mapping[str, Any]) -> tuple[str, str]:
    wrap = texture.get("wrap", "repeat")
    return (wrap, wrap) if isinstance(wrap, str) else tuple(wrap)


def _wrapped(i: Array, size: int, mode: str) -> Array:
    """Returns the numbers of texels in [0, size) that stand for the numbers i outside of the picture."""
    if mode == "clamp":
        return np.clip(i, 0, size - 1)
    if mode == "repeat":
        return i % size
    i = i % (2 * size)
    return np.where(i < size, i, 2 * size - 1 - i)


def size_of(texture: Mapping[str, Any]) -> Array:
    """Returns the width and the height (2,) of the picture [texels]."""
    return np.array(_stored(texture["texture"]).shape[1::-1])


def _between(uv: Array, size: Array, texel: Callable[[Array, Array], Array]) -> Array:
    """Returns the bilinear mean (N, C) of the four texels round each place uv (N, 2).

    size: width and height of the picture (2,) [texels].
    texel: returns the texels (N, C) at columns (N,) and rows (N,), which may lie outside of the picture.
    """
    place = uv * size - 0.5
    corner = np.floor(place).astype(int)
    (s, t) = (place - corner).T[..., None]
    x, y = corner.T
    low = texel(x, y) * (1 - s) + texel(x + 1, y) * s
    high = texel(x, y + 1) * (1 - s) + texel(x + 1, y + 1) * s
    return low * (1 - t) + high * t


def sampled(texture: Mapping[str, Any], uv: Array, srgb: bool) -> Array:
    """Returns the values (N, 3) of a picture at uv (N, 2), without the factor. srgb: whether the file is sRGB-encoded."""
    stored = _stored(texture["texture"])
    values = (decoded(stored) if srgb else stored).astype(np.float64)
    height, width = values.shape[:2]
    u, v = _wraps(texture)
    return _between(uv, size_of(texture), lambda x, y: values[_wrapped(y, height, v), _wrapped(x, width, u)])


def coloured(texture: Mapping[str, Any], uv: Array) -> Array:
    """Returns the values (N, 3) of a texture for a colour, linear Rec. 709."""
    factor = np.asarray(texture.get("factor", 1.0), dtype=np.float64)
    return sampled(texture, uv, texture.get("encoding", "auto") != "linear") * factor


def numbered(texture: Mapping[str, Any], uv: Array) -> Array:
    """Returns the values (N, 1) of a texture for a number."""
    factor = np.ravel(texture.get("factor", 1.0))[0]
    values = sampled(texture, uv, texture.get("encoding", "auto") == "srgb") * factor
    channel = "rgb".index(texture.get("channel", "r"))
    return values[:, channel : channel + 1]


def mapped_normal(texture: Mapping[str, Any], uv: Array) -> Array:
    """Returns the normals (N, 3) of a normal map, in the frame of tangent, bitangent and normal."""
    scale = texture.get("scale", 1.0)
    return unit((2 * sampled(texture, uv, False) - 1) * np.array([scale, scale, 1.0]))


def bumped_normal(texture: Mapping[str, Any], uv: Array) -> Array:
    """Returns the normals (N, 3) of a bump map, in the frame of tangent, bitangent and normal."""
    heights = _stored(texture["texture"])[..., 0].astype(np.float64) * texture.get("height", 0.05)
    rows, columns = heights.shape
    mode_u, mode_v = _wraps(texture)

    def at(x: Array, y: Array) -> Array:
        return heights[_wrapped(y, rows, mode_v), _wrapped(x, columns, mode_u)]

    def border(i: Array, size: int, mode: str) -> Array:
        return (mode == "clamp") & ((i <= 0) | (i >= size - 1))

    def normal(x: Array, y: Array) -> Array:
        # The central difference spans two texels. Texels are square, so the width counts in both directions.
        dx = np.where(border(x, columns, mode_u), 0, (at(x + 1, y) - at(x - 1, y)) * columns / 2)
        dy = np.where(border(y, rows, mode_v), 0, (at(x, y + 1) - at(x, y - 1)) * columns / 2)
        return np.stack([-dx, -dy, np.ones_like(dx)], axis=1)

    return unit(_between(uv, size_of(texture), normal))
