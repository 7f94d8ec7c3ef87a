"""Scattered: reflectance between samples at scattered directions, by radial functions of its logarithm.

The logarithms of X, Y and Z are interpolated, not those of red, green and blue: a colour outside of the gamut has negative
channels, but X, Y and Z of any light are positive. Around each point a thin plate spline goes through the nearest samples.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Array, Float64
from glshade.measured.rusinkiewicz import angles, directions, spherical
from glshade.measured.samples import Axis, Samples, lit_from_x
from glshade.optics.observer import matching, rgb_weights

# How many samples decide about a point. With 60, the errors at samples that were left out stay the same.
NEIGHBOURS = 30
# Samples whose places differ by less than this count as one, and their logarithms are averaged [rad].
SAME_PLACE = 1e-6
# A sample's image stands in where no sample lies within so many times the usual distance between neighbours. The mirror image
# in the plane of incidence is as good as a sample. The image with l and v exchanged is not: measured data break reciprocity by
# tens of percent, so that such images only fill what was not measured.
NEAR_MIRRORED, NEAR_EXCHANGED = 0.5, 3.0
# A sample that is darker than this share of three quarters of its neighbours is a dropout: something stood in the way.
DROPOUT, OF_NEIGHBOURS = 0.25, 12
# Values below this share of the largest one are noise of instruments, which ends at 0.
NOISE = 2.0**-28
# Around a peak, the half vector or back vector is nearer to the normal than AROUND_PEAK [rad]. Where the light is nearer to the
# normal than SLANTED [rad], both peaks are one.
AROUND_PEAK, SLANTED = np.radians(5.0), np.radians(12.0)


def without_dropouts(samples: Samples) -> Samples:
    """Returns the samples without dropouts, and with a note where there were some."""
    from scipy.spatial import cKDTree

    if len(samples) <= OF_NEIGHBOURS or "phi_d" not in samples.axes:
        return samples
    # Dropouts are looked for among the directions themselves, where an instrument's consecutive samples are neighbours.
    places = np.concatenate(lit_from_x(samples.l, samples.v), axis=1)
    _, near = cKDTree(places).query(places, OF_NEIGHBOURS + 1)
    brightness = samples.f.max(axis=1)
    usual = np.quantile(brightness[near[:, 1:]], 0.25, axis=1)
    dropped = brightness < DROPOUT * usual
    if not dropped.any():
        return samples
    note = f"{np.sum(dropped)} samples far darker than their neighbours are left out as dropouts of the instrument."
    return replace(samples.chosen(~dropped), notes=(*samples.notes, note))


class Scattered:
    """Reflectance as a function of theta_h, theta_d and phi_d that goes through samples.

    retro: whether the angles are those about the back vector.
    one_sided: whether phi_d and -phi_d give the same value, because only one side of the plane of incidence was measured.
    largest: the largest measured angles of the light and of the viewer from the normal [rad].
    """

    def __init__(self, samples: Samples) -> None:
        from scipy.spatial import cKDTree

        self.retro = peaks_at_light(samples) if samples.retro is None else samples.retro
        self.largest = (_steepest(samples.l), _steepest(samples.v))
        self._axes = samples.axes
        theta_h, theta_d, phi_d = samples.about(self.retro)
        self._range = [(float(a.min()), float(a.max())) for a in (theta_h, theta_d)]
        xyz = samples.f @ rgb_to_xyz()
        floor = NOISE * xyz.max()
        places, logarithms = _merged(places_of(theta_h, theta_d, phi_d, self._axes), np.log(np.maximum(xyz, floor)))
        self.one_sided = True
        if "phi_d" in self._axes:
            images = _with_images(places, logarithms, np.array([1.0, 1.0, 1.0, -1.0]), NEAR_MIRRORED)
            # Where the other side was measured too, nearly all samples have a neighbour near their image.
            self.one_sided = len(images[0]) > 1.5 * len(places)
            places, logarithms = images if self.one_sided else (places, logarithms)
            exchanged = np.array([1.0, 1.0, -1.0, -1.0])
            places, logarithms = _with_images(places, logarithms, exchanged, NEAR_EXCHANGED)
        self._places, self._logarithms, self._tree = places, logarithms, cKDTree(places)
        self._spline = _spline(places, logarithms)

    def at(self, theta_h: Array, theta_d: Array, phi_d: Array) -> Float64:
        """Returns f (N, 3) [1/sr], linear Rec. 709, at angles (N,) [rad]; past the measured angles the last one holds."""
        if "phi_d" in self._axes:
            theta_h, theta_d, phi_d = self._within(theta_h, theta_d, phi_d)
        else:
            theta_h, theta_d = (np.clip(a, *ends) for a, ends in zip((theta_h, theta_d), self._range, strict=True))
        at = places_of(theta_h, theta_d, phi_d, self._axes)
        xyz = np.exp(np.clip(self._spline(at), *self._between(at)))
        result: Float64 = np.maximum(xyz @ np.linalg.inv(rgb_to_xyz()), 0.0)
        return result

    def _between(self, at: Float64) -> tuple[Float64, Float64]:
        """Returns the smallest and the largest logarithms (N, 3) of the samples near places (N, K): a spline may overshoot."""
        _, near = self._tree.query(at, min(NEIGHBOURS, len(self._places)))
        of_neighbours = self._logarithms[near.reshape(len(at), -1)]
        return of_neighbours.min(axis=1), of_neighbours.max(axis=1)

    def _within(self, theta_h: Array, theta_d: Array, phi_d: Array) -> tuple[Float64, Float64, Float64]:
        """Returns the angles of the nearest measured directions: both directions move towards the normal by the same angle.

        So grazing light meets the lobe of the last angle, and the peaks at the mirror direction and at l = v stay there.
        """
        high, low = max(self.largest), min(self.largest)
        l, v = directions(theta_h, theta_d, phi_d)
        theta_l, theta_v = (np.arccos(np.clip(d[..., 2], -1, 1)) for d in (l, v))
        # Exchanging l and v gives a sample's image, so that either of both may reach the larger angle.
        excess = np.maximum(np.minimum(theta_l, theta_v) - low, np.maximum(theta_l, theta_v) - high)
        beyond = excess > 0
        moved = (
            spherical(np.maximum(theta - excess, 0.0), np.arctan2(d[..., 1], d[..., 0]))[beyond]
            for theta, d in ((theta_l, l), (theta_v, v))
        )
        found = np.array(np.broadcast_arrays(theta_h, theta_d, phi_d))
        found[:, beyond] = angles(*moved)
        return found[0], found[1], found[2]


def _spline(places: Float64, logarithms: Float64) -> Any:
    """Returns the spline through the logarithms (N, 3) at places (N, K), which takes places (M, K)."""
    from scipy.interpolate import RBFInterpolator

    with warnings.catch_warnings():
        # SciPy warns of a spline without the plane that usually belongs to it. Samples often lie in one surface, such as those
        # of one angle of the light. They do not fix the slope across that surface, and the plane would run away.
        warnings.simplefilter("ignore", UserWarning)
        return RBFInterpolator(places, logarithms, min(NEIGHBOURS, len(places)), kernel="thin_plate_spline", degree=0)


def _steepest(directions: Float64) -> float:
    """Returns the largest angle of directions (N, 3) from the normal [rad]."""
    return float(np.arccos(np.clip(directions[:, 2].min(), -1, 1)))


@cache
def rgb_to_xyz() -> Float64:
    """Returns the matrix (3, 3) for rows of linear Rec. 709: rgb @ matrix = XYZ."""
    result: Float64 = np.linalg.inv(np.linalg.lstsq(matching(), rgb_weights(), rcond=None)[0])
    return result


def peaks_at_light(samples: Samples) -> bool:
    """Returns whether samples around l = v are brighter than those around the mirror direction, at the median."""
    slanted = samples.chosen(np.asarray(samples.l[:, 2] < np.cos(SLANTED)))
    mirror, back = (
        slanted.f.max(axis=1)[slanted.about(retro)[0] < AROUND_PEAK] if len(slanted) else np.empty(0) for retro in (False, True)
    )
    return bool(len(back)) and (not len(mirror) or bool(np.median(back) > np.median(mirror)))


def places_of(theta_h: Array, theta_d: Array, phi_d: Array, axes: tuple[Axis, ...]) -> Float64:
    """Returns the places (N, K) at which samples are interpolated, for angles (N,) [rad]. axes: the angles that count."""
    along_h = np.sqrt(theta_h)
    if "phi_d" in axes:
        # At h = n and at l = v phi_d means nothing, so these two columns vanish there.
        lean = np.sqrt(theta_h / (math.pi / 2)) * theta_d
        return np.stack([along_h, theta_d, lean * np.cos(phi_d), lean * np.sin(phi_d)], axis=-1)
    columns = [column for axis, column in (("theta_h", along_h), ("theta_d", theta_d)) if axis in axes]
    return np.stack(columns, axis=-1)


def _merged(places: Float64, logarithms: Float64) -> tuple[Float64, Float64]:
    """Returns places (M, K) of which no two are the same, and the means (M, 3) of the logarithms there."""
    _, first, of = np.unique(np.round(places / SAME_PLACE), axis=0, return_index=True, return_inverse=True)
    counts = np.bincount(of.ravel())
    sums = np.stack([np.bincount(of.ravel(), column) for column in logarithms.T], axis=-1)
    return places[first], sums / counts[:, None]


def _with_images(places: Float64, logarithms: Float64, signs: Float64, near: float) -> tuple[Float64, Float64]:
    """Returns places and logarithms with images of those samples near whose image there is no sample.

    places: (N, K).
    logarithms: (N, 3).
    signs: (K,), which a place is multiplied by to get its image.
    near: what is near, in usual distances between neighbours.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(places)
    usual = float(np.median(tree.query(places, 2)[0][:, 1])) if len(places) > 1 else 1.0
    images = places * signs
    # The image of a sample in the plane of symmetry is the sample itself.
    alone: NDArray[np.bool_] = tree.query(images)[0] > near * usual
    return np.concatenate([places, images[alone]]), np.concatenate([logarithms, logarithms[alone]])
