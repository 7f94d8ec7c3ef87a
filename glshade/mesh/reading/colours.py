"""Colours: conversions of vertex colours, in float64."""

from __future__ import annotations

import numpy as np

from glshade.arrays import Float64


def srgb_to_linear(x: Float64) -> Float64:
    """Returns linear values for sRGB-encoded values x in [0, 1] of any shape (IEC 61966-2-1)."""
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.0) + 0.055) / 1.055) ** 2.4)


def with_alpha(colours: Float64) -> Float64:
    """Returns colours with alpha (N, 4). Colours (N, 3) become opaque; of longer rows the first four columns are taken."""
    return np.column_stack([colours, np.ones(len(colours))]) if colours.shape[1] == 3 else colours[:, :4]
