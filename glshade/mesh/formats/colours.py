"""Colours of vertices, in float64 until the mesh rounds them."""

from __future__ import annotations

import numpy as np

from glshade.mesh.mesh import Float64


def srgb_to_linear(x: Float64) -> Float64:
    """sRGB-encoded [0, 1] to linear, any shape. IEC 61966-2-1."""
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.0) + 0.055) / 1.055) ** 2.4)


def with_alpha(colours: Float64) -> Float64:
    """(N, 4) from colours (N, 3 or more); opaque where they do not say."""
    return np.column_stack([colours, np.ones(len(colours))]) if colours.shape[1] == 3 else colours[:, :4]
