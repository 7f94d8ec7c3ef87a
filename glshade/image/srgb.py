"""sRGB: the encoding of 8-bit pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def linear_to_srgb(c: NDArray[Any]) -> NDArray[np.float32]:
    """Linear [0, 1] to sRGB-encoded [0, 1], any shape; what is outside is clipped. IEC 61966-2-1."""
    c = np.clip(np.asarray(c, dtype=np.float32), 0.0, 1.0)
    return np.where(c > 0.0031308, 1.055 * np.maximum(c, 0.0031308) ** (1 / 2.4) - 0.055, 12.92 * c).astype(np.float32)


def srgb_to_linear(c: NDArray[Any]) -> NDArray[np.float32]:
    """sRGB-encoded [0, 1] to linear, any shape. IEC 61966-2-1."""
    c = np.asarray(c, dtype=np.float32)
    return np.where(c > 0.04045, ((np.maximum(c, 0.04045) + 0.055) / 1.055) ** 2.4, c / 12.92).astype(np.float32)
