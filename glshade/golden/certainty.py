"""Certainty: the pixels of a scene's picture that every driver must show alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import group_starts
from glshade.golden.change import perceived
from glshade.verification.judgement import PixelClass

if TYPE_CHECKING:
    from glshade.verification.judgement import Expected

# A pixel is certain if the values that the reference allows it lie no further apart than this, as a screen shows them: two
# drivers may then round it to neighbouring codes.
ONE_CODE = 1.5 / 255


def certain_pixels(expected: Expected) -> NDArray[np.bool_]:
    """Returns the pixels (H * W,) whose value is certain. expected: the linear values that the reference allows."""
    certain = expected.classes == PixelClass.BACKGROUND
    start = group_starts(expected.pixel)
    if len(start):
        pixel = expected.pixel[start]
        low = perceived(np.minimum.reduceat(expected.low[:, :3], start))
        high = perceived(np.maximum.reduceat(expected.high[:, :3], start))
        certain[pixel] = ~expected.open[pixel] & ((high - low).max(axis=1) <= ONE_CODE)
    return np.asarray(certain)
