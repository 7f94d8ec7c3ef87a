"""Colours: conversions of vertex colours, in float64."""

from __future__ import annotations

import numpy as np

from glshade.arrays import Array, Float64


def srgb_to_linear(x: Float64) -> Float64:
    """Returns linear values for sRGB-encoded values x in [0, 1] of any shape (IEC 61966-2-1)."""
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.0) + 0.055) / 1.055) ** 2.4)


def with_alpha(colours: Float64) -> Float64:
    """Returns colours with alpha (N, 4). Colours (N, 3) become opaque; of longer rows the first four columns are taken."""
    return np.column_stack([colours, np.ones(len(colours))]) if colours.shape[1] == 3 else colours[:, :4]


def display_colours(colours: Float64) -> Float64:
    """Returns linear colours with alpha (N, 4) for sRGB-encoded colours (N, 3 or 4) in [0, 1]. Alpha is linear already."""
    result = with_alpha(np.asarray(colours, dtype=np.float64)).copy()
    result[:, :3] = srgb_to_linear(result[:, :3])
    return result


def fractions(integers: Array) -> Float64:
    """Returns colours in [0, 1] for integers. Their greatest value is 255 where none is larger, otherwise 65535 or 2^32 - 1.

    The type of the integers does not decide, because programs write bytes as 32-bit integers too.
    """
    values = np.asarray(integers, dtype=np.float64)
    largest = values.max(initial=0.0)
    return values / next((top for top in (255.0, 65535.0) if largest <= top), 2.0**32 - 1)
