"""sRGB: the encoding of 8-bit pictures, after IEC 61966-2-1."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# The curve is a straight line through 0 up to the knee, and a power above it. These are the knee's linear and its encoded
# value. Both forms are computed for every number, and np.maximum keeps the power's argument positive where the line is chosen.
LINEAR_KNEE, ENCODED_KNEE = 0.0031308, 0.04045


def linear_to_srgb(c: NDArray[Any]) -> NDArray[np.float32]:
    """Returns sRGB-encoded numbers in [0, 1] for linear numbers of any shape, which are clipped to [0, 1] first."""
    c = np.clip(np.asarray(c, dtype=np.float32), 0.0, 1.0)
    power = 1.055 * np.maximum(c, LINEAR_KNEE) ** (1 / 2.4) - 0.055
    return np.where(c > LINEAR_KNEE, power, 12.92 * c).astype(np.float32)


def srgb_to_linear(c: NDArray[Any]) -> NDArray[np.float32]:
    """Returns linear numbers for sRGB-encoded numbers in [0, 1] of any shape."""
    c = np.asarray(c, dtype=np.float32)
    power = ((np.maximum(c, ENCODED_KNEE) + 0.055) / 1.055) ** 2.4
    return np.where(c > ENCODED_KNEE, power, c / 12.92).astype(np.float32)
