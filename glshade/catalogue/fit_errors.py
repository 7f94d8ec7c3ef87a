"""Fit errors: how far materials and tables lie from measured samples, by the angle of the light."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from glshade.arrays import Float64
from glshade.brdfs import Brdf
from glshade.catalogue.baking import reflectance
from glshade.measured.samples import Samples

# The borders of the ranges of the light's angle from the normal [degrees].
BORDERS = (0, 15, 30, 45, 60, 75, 90)
Reflectance = Callable[[Float64, Float64], Float64]


@dataclass(frozen=True)
class AngleErrors:
    """The errors at the samples whose light comes from a range of angles.

    low, high: the range of the light's angle from the normal [degrees].
    count: the number of samples.
    medians: name -> the median of the relative errors [1].
    """

    low: int
    high: int
    count: int
    medians: Mapping[str, float]


def of_material(material: Brdf) -> Reflectance:
    """Returns the function that gives f (N, 3) [1/sr] of a material at directions (N, 3)."""
    return lambda l, v: reflectance(material, l, v)


def relative_errors(f: Float64, samples: Samples) -> Float64:
    """Returns the error (N,) of reflectances f (N, 3) at the samples: the largest of the three channels' errors over the
    sample's largest channel. Negative channels of a sample count as 0; a black sample's error is NaN."""
    true = np.maximum(samples.f, 0.0)
    largest = true.max(axis=1)
    off = np.abs(f - true).max(axis=1)
    result: Float64 = np.divide(off, largest, out=np.full(len(off), np.nan), where=largest > 0)
    return result


def errors_by_angle(samples: Samples, compared: Mapping[str, Reflectance]) -> list[AngleErrors]:
    """Returns the errors of several functions for each range of angles that has samples. compared: name -> function."""
    theta = np.degrees(np.arccos(np.clip(samples.l[:, 2], -1, 1)))
    errors = {name: relative_errors(f(samples.l, samples.v), samples) for name, f in compared.items()}
    rows = []
    for low, high in pairwise(BORDERS):
        inside = (theta >= low) & ((theta < high) | (high == BORDERS[-1]))
        if any(np.isfinite(error[inside]).any() for error in errors.values()):
            medians = {name: float(np.nanmedian(error[inside])) for name, error in errors.items()}
            rows.append(AngleErrors(low, high, int(inside.sum()), medians))
    return rows
