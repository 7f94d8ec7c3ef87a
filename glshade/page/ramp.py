"""Ramp: the colours in which pages show the size of an error."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

# The colours of the error map, from the least error to the greatest, sRGB-encoded from 0 to 255. Their lightness rises all the
# way, so that they are in order for every eye, and on paper.
RAMP = np.array([(8, 10, 18), (32, 42, 110), (122, 40, 130), (214, 72, 72), (250, 160, 50), (252, 240, 160)], dtype=np.float64)
# Errors up to this one all have the first colour [linear]. It is smaller than the rounding error of a float32 value near 1.
LEAST = 1e-8


def heat(error: Array, greatest: float | None = None) -> tuple[Array, float, float]:
    """Returns (map (H, W, 3) uint8, least, greatest) of errors (H, W).

    The map shows the errors as colours, on a logarithmic scale from `least` to `greatest`. Infinities and NaN have the colour
    of the greatest error.
    greatest: the end of the scale, at least 10 * LEAST; by default the largest finite error, so that maps of several pictures
        with one `greatest` can be compared.
    """
    finite = np.where(np.isfinite(error), error, 0.0)
    if greatest is None:
        greatest = max(float(finite.max(initial=0.0)), 10 * LEAST)
    place = np.log(np.clip(finite, LEAST, greatest) / LEAST) / np.log(greatest / LEAST)
    return colours(np.where(np.isfinite(error), place, 1.0)), LEAST, greatest


def colours(place: Array) -> Array:
    """Returns the colours (..., 3) uint8 at places (...) on the ramp, from 0 to 1."""
    place = place * (len(RAMP) - 1)
    lower = np.minimum(place.astype(np.intp), len(RAMP) - 2)
    share = (place - lower)[..., None]
    result: Array = np.rint(RAMP[lower] * (1 - share) + RAMP[lower + 1] * share).astype(np.uint8)
    return result


def css() -> str:
    """Returns the rule of a style sheet that gives elements of the class `ramp` all colours, from left to right."""
    stops = ", ".join(f"rgb({int(r)} {int(g)} {int(b)})" for r, g, b in RAMP)
    return f".ramp {{ background-image: linear-gradient(90deg, {stops}); }}\n"
