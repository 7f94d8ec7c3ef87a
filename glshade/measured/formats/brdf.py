"""Cornell: text of the Program of Computer Graphics at Cornell University, which holds spectra for pairs of directions.

After comments, which begin with #, come the number of wavelengths, the wavelengths [nm], and one sample after another: theta_i,
phi_i, theta_s, phi_s [rad] and one value of f [1/sr] for each wavelength. The direction i is that to the light, and s that of
the scattered light. The colour of a sample is that under daylight, CIE D65.
"""

from __future__ import annotations

import math
import re
from functools import cache
from itertools import pairwise

import numpy as np

from glshade.arrays import Float64
from glshade.measured.formats import MeasuredFile, MeasuredFormat
from glshade.measured.number_lines import Rows, numbers, text_lines
from glshade.measured.rusinkiewicz import spherical
from glshade.measured.samples import Samples
from glshade.optics.observer import reflected

# The wavelengths that a file may name [nm], and the most of them: steps of 1 nm over all that optics calls light.
SHORTEST, LONGEST, MOST_WAVELENGTHS = 100.0, 20_000.0, 2000
# The wavelengths that the eye sees [nm]. Where a file's wavelengths end before, its last value holds.
VISIBLE = (360.0, 830.0)
# The largest angle from the normal [rad]; files give angles with six digits.
RIGHT_ANGLE = math.pi / 2 + 1e-5
# The numbers of a sample before its spectrum.
ANGLES = 4


class Brdf(MeasuredFormat):
    """Cornell's text files, which end in .brdf."""

    description = ".brdf (Cornell)"

    def recognises(self, data: bytes) -> bool:
        return re.search(rb"^#[ \t]*num wls\b", data[:4096], re.MULTILINE) is not None

    def read(self, file: MeasuredFile) -> Samples:
        wavelengths: list[float] = []
        count, rows = 0, None
        for line, text in text_lines(file):
            found = numbers(file, line, text.partition("#")[0])
            if not count and found:
                count, found = self._count(file, line, found[0]), found[1:]
            if count and len(wavelengths) < count:
                missing = count - len(wavelengths)
                wavelengths, found = wavelengths + found[:missing], found[missing:]
                if len(wavelengths) == count:
                    self._check_wavelengths(file, line, wavelengths)
                    rows = Rows(file, ANGLES + count)
            if rows is not None:
                rows.add(line, found)
        if rows is None:
            raise file.fail(f"ends before its {count or 'first'} wavelengths are complete; is the file cut short?")
        return self._samples(rows, np.array(wavelengths))

    def _count(self, file: MeasuredFile, line: int, number: float) -> int:
        if not (number == int(number) and 1 <= number <= MOST_WAVELENGTHS):
            raise file.fail(f"the number of wavelengths must be whole and from 1 to {MOST_WAVELENGTHS}, not {number:g}", line)
        return int(number)

    def _check_wavelengths(self, file: MeasuredFile, line: int, wavelengths: list[float]) -> None:
        if min(wavelengths) < SHORTEST or max(wavelengths) > LONGEST:
            raise file.fail(f"wavelengths must lie between {SHORTEST:g} and {LONGEST:g} nm", line)
        if any(a >= b for a, b in pairwise(wavelengths)):
            raise file.fail("wavelengths must rise from each to the next", line)
        if wavelengths[-1] < VISIBLE[0] or wavelengths[0] > VISIBLE[1]:
            raise file.fail("no wavelength is visible, so that the samples have no colour", line)

    def _samples(self, rows: Rows, wavelengths: Float64) -> Samples:
        table = rows.array()
        theta_i, phi_i, theta_s, phi_s = table[:, :ANGLES].T
        wrong = (theta_i < 0) | (theta_s < 0) | (theta_i > RIGHT_ANGLE) | (theta_s > RIGHT_ANGLE)
        rows.refuse(wrong, "an angle from the normal is not between 0 and pi/2; are the angles in degrees?")
        rows.refuse((np.abs(phi_i) > 100) | (np.abs(phi_s) > 100), "an azimuth is above 100; are the angles in degrees?")
        rows.refuse((table[:, ANGLES:] < 0).any(axis=1), "a value is negative, which no reflectance is")
        l, v, f = spherical(theta_i, phi_i), spherical(theta_s, phi_s), colours(wavelengths, table[:, ANGLES:])
        above = (l[:, 2] > 1e-4) & (v[:, 2] > 1e-4)
        left_out = f"{np.sum(~above)} samples at the horizon are left out"
        return Samples(l, v, f).chosen(above) if above.all() else Samples(l, v, f, notes=(left_out,)).chosen(above)


def colours(wavelengths: Float64, values: Float64) -> Float64:
    """Returns linear Rec. 709 (N, 3) under D65 of spectra (N, W) at wavelengths (W,) [nm], whose ends hold beyond them."""
    return values @ colour_weights(wavelengths)


def colour_weights(wavelengths: Float64) -> Float64:
    """Returns the weights (W, 3) that turn values at wavelengths (W,) [nm] into linear Rec. 709 under D65.

    Equal values give that value in all three channels. The first and the last value hold beyond their wavelengths.
    """
    low, high = min(VISIBLE[0], wavelengths[0] - 1), max(VISIBLE[1], wavelengths[-1] + 1)
    each = np.pad(np.eye(len(wavelengths)), ((0, 0), (1, 1)), mode="edge")
    return reflected(np.array([low, *wavelengths, high]), each)


# The wavelengths of files that are written [nm].
WRITTEN = np.arange(400.0, 701.0, 20.0)
# How much it counts that a spectrum has its colour exactly, beside its smoothness and beside the flatness of a grey's spectrum.
EXACTNESS, FLATNESS = 1e5, 0.1


def written(samples: Samples, comment: str) -> str:
    """Returns the text of a file whose spectra have the colours of the samples under daylight.

    samples: their colours must not be negative.
    comment: one line for the head of the file.
    """
    lines = [f"# {comment}", "", "# num wls", str(len(WRITTEN)), "", "# wls", " ".join(f"{w:g}" for w in WRITTEN), ""]
    lines += ["# theta i, phi i, theta s, phi_s, spectral sample values", ""]
    (theta_i, phi_i), (theta_s, phi_s) = (
        (np.arctan2(np.hypot(d[:, 0], d[:, 1]), d[:, 2]), np.arctan2(d[:, 1], d[:, 0])) for d in (samples.l, samples.v)
    )
    rows = np.column_stack([theta_i, phi_i, theta_s, phi_s, samples.f @ primary_spectra()])
    lines += [" ".join(f"{number:.9g}" for number in row) for row in rows.tolist()]
    return "\n".join(lines) + "\n"


@cache
def primary_spectra() -> Float64:
    """Returns smooth spectra (3, W) at the wavelengths WRITTEN without negative values, whose colours under daylight are red,
    green and blue of Rec. 709. Their sum, a white, is nearly flat."""
    from scipy.optimize import nnls

    count = len(WRITTEN)
    exact = EXACTNESS * np.kron(np.eye(3), colour_weights(WRITTEN).T)
    smooth = np.kron(np.eye(3), np.diff(np.eye(count), 2, axis=0))
    flat = FLATNESS * np.kron(np.ones((1, 3)), np.eye(count))
    wanted = np.concatenate([EXACTNESS * np.eye(3).ravel(), np.zeros(len(smooth)), np.full(count, FLATNESS)])
    found: Float64 = nnls(np.concatenate([exact, smooth, flat]), wanted)[0].reshape(3, count)
    return found
