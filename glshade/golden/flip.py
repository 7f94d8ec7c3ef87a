"""FLIP: an estimate of how visible the difference of two pictures is, from 0 (not at all) to 1."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.pair import Pair
from glshade.golden.result import Finding, LayerResult, Outcome
from glshade.image.metrics import PIXELS_PER_DEGREE, flip_map
from glshade.image.srgb import srgb_to_linear

Array = NDArray[Any]

# FLIP's filters reach this far [pixels], at PIXELS_PER_DEGREE: three standard deviations of the widest one (Andersson et al.
# 2020, section 4.1), ceil(3 sqrt(0.04 / (2 pi^2)) 67).
REACH = math.ceil(3 * math.sqrt(0.04 / (2 * math.pi**2)) * PIXELS_PER_DEGREE)
# The value up to which OpenImageIO's exposures tell values apart by default. Brighter pictures need further exposures.
USUAL_BRIGHTEST = 2.0


def with_flip(result: LayerResult, pair: Pair, most: float) -> LayerResult:
    """Returns a layer's result with its FLIP, as a failure where that is more than `most`.

    A layer without colours, and one with an infinite or NaN value, has no FLIP, so its result stays as it is.
    """
    value = mean_flip(pair) if result.metrics is not None else None
    if result.metrics is None or value is None:
        return result
    finding = result.finding
    if value > most and finding.outcome < Outcome.FAIL:
        finding = Finding(Outcome.FAIL, f"FLIP is {value:.3g}, and at most {most:g} is allowed")
    return replace(result, finding=finding, metrics=replace(result.metrics, flip=value))


def mean_flip(pair: Pair) -> float | None:
    """Returns the mean of FLIP over the smallest box that holds all pixels that differ; None for a layer without colours.

    8-bit pictures are compared as a screen shows them (Andersson et al. 2020), floats at several exposures (Andersson et al.
    2021). A picture with alpha is compared over black and over white, and the larger value counts. All values must be finite.
    """
    channels = _colour_channels(pair.channels)
    if channels is None or pair.holds_ids:
        return None
    if not pair.count:
        return 0.0
    rows, columns = (np.flatnonzero(pair.changed.any(axis=axis)) for axis in (1, 0))
    box = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    # The values in the box depend on the pixels around it, too.
    around = tuple(slice(max(part.start - REACH, 0), part.stop + REACH) for part in box)
    inner = tuple(slice(part.start - wide.start, part.stop - wide.start) for part, wide in zip(box, around, strict=True))
    pictures = [values[around] for values in (pair.reference, pair.test)]
    hdr = any(picture.dtype != np.uint8 for picture in pictures)
    # An opaque picture looks the same over every background.
    backgrounds = (0.0,) if all(_opaque(picture, pair.channels) for picture in pictures) else (0.0, 1.0)
    return max(_mean([_shown(p, pair.channels, channels, b) for p in pictures], inner, hdr) for b in backgrounds)


def _mean(pictures: list[Array], inner: tuple[slice, ...], hdr: bool) -> float:
    """Returns the mean of FLIP over a part of two pictures, linear (H, W, 3)."""
    brightest = max(USUAL_BRIGHTEST, *(float(picture.max()) for picture in pictures))
    errors = flip_map(pictures[0], pictures[1], brightest if hdr else None)
    return float(np.mean(errors[inner], dtype=np.float64))


def _shown(values: Array, names: tuple[str, ...], channels: tuple[str, ...], background: float) -> Array:
    """Returns the colours of a picture over a grey background: linear (H, W, 3).

    names: the names of the picture's channels. channels: those of red, green and blue.
    """
    colours = values[..., [names.index(name) for name in channels]]
    alpha = values[..., names.index("A"), None] if "A" in names else None
    if values.dtype != np.uint8:
        # Floats are premultiplied, as in all formats that hold floats.
        return colours if alpha is None else colours + (1 - alpha) * background
    linear = srgb_to_linear(colours / np.float32(255))
    return linear if alpha is None else background + (linear - background) * (alpha / np.float32(255))


def _opaque(values: Array, names: tuple[str, ...]) -> bool:
    """Returns whether a picture has no alpha, or one that is 1 everywhere."""
    return "A" not in names or bool((values[..., names.index("A")] == (255 if values.dtype == np.uint8 else 1)).all())


def _colour_channels(names: tuple[str, ...]) -> tuple[str, ...] | None:
    """Returns the names of red, green and blue among the channels of a layer; None for a layer without colours."""
    if {"R", "G", "B"} <= set(names):
        return ("R", "G", "B")
    return ("Y", "Y", "Y") if set(names) - {"A"} == {"Y"} else None
