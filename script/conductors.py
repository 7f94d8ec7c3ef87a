"""Derives eta and k of the presets' metals from published spectra, in linear Rec. 709. script/make-conductors calls it.

Fresnel's equations give the reflectance spectrum at each of 90 angles. Under D65 the CIE 1931 2-degree observer sees it as a
colour. For each channel, (eta, k) is fitted to the channel's curve over the angles, by least squares weighted with the cosine.
The tables of D65 and of the observer are Mitsuba's. The spectra are not part of this repository.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glshade.presets import preset

Array = NDArray[np.float64]

# Preset -> file below `database/data` of refractiveindex.info (CC0; github.com/polyanskiy/refractiveindex.info-database). Where
# the measurements of a metal differ, this takes one that others confirm: Olmon's gold is within 0.01 of McPeak's and Palik's,
# and 0.05 above Johnson's in green; Rakic's chromium is near Palik's and Sytchkova's, and 0.1 above Johnson's.
FILES = {
    "aluminium": "main/Al/nk/Rakic.yml",
    "brass": "other/alloys/Cu-Zn/nk/Querry-Cu70Zn30.yml",
    "chromium": "main/Cr/nk/Rakic-LD.yml",
    "copper": "main/Cu/nk/Johnson.yml",
    "gold": "main/Au/nk/Olmon-ev.yml",
    "iron": "main/Fe/nk/Johnson.yml",
    "silver": "main/Ag/nk/Johnson.yml",
    "steel": "other/alloys/stainless steel/nk/Karlsson-austenitic.yml",
    "titanium": "main/Ti/nk/Johnson.yml",
}
COS = np.cos(np.radians(np.arange(90)))


@dataclass(frozen=True)
class Spectrum:
    """The index of refraction eta + i k over wavelengths, linear between them.

    wavelength: (N,) in ascending order [nm].
    eta: (N,) the real part at each wavelength.
    k: (N,) the imaginary part at each wavelength.
    """

    wavelength: Array
    eta: Array
    k: Array


@dataclass(frozen=True)
class Fit:
    """A fitted index of refraction for each channel of linear Rec. 709, and its residuals.

    eta: (3,) the real part.
    k: (3,) the imaginary part.
    f0: (3,) the spectrum's colour at normal incidence.
    rms: (3,) the root mean square of the residuals over the angles, weighted with the cosine.
    largest: (3,) the largest residual over the angles.
    """

    eta: Array
    k: Array
    f0: Array
    rms: Array
    largest: Array


def from_yml(path: Path) -> Spectrum:
    """Reads a table of refractiveindex.info, which has rows of wavelength [um], n and k."""
    rows = re.findall(r"^ +([\d.eE+-]+) +([\d.eE+-]+) +([\d.eE+-]+) *$", path.read_text(encoding="utf-8"), re.MULTILINE)
    wavelength, eta, k = np.array(rows, dtype=np.float64).T
    return Spectrum(wavelength * 1000, eta, k)


def from_spd(folder: Path, symbol: str) -> Spectrum:
    """Reads two files of Mitsuba, for eta and for k, which have rows of wavelength [nm] and value."""
    (wavelength, eta), (also, k) = (np.loadtxt(folder / f"{symbol}.{part}.spd").T for part in ("eta", "k"))
    return Spectrum(wavelength, eta, np.interp(wavelength, also, k))


def reflectance(eta: Array, k: Array, cos: Array) -> Array:
    """Returns the Fresnel reflectance (...) of unpolarised light from vacuum, by complex amplitudes. cos (...): cosine of the
    angle of incidence."""
    index = eta + 1j * k
    cos_inside = np.sqrt(1 - (1 - cos * cos) / (index * index))
    across = (cos - index * cos_inside) / (cos + index * cos_inside)
    along = (index * cos - cos_inside) / (index * cos + cos_inside)
    mean: Array = (np.abs(across) ** 2 + np.abs(along) ** 2) / 2
    return mean


def rgb_weights(wavelength: Array) -> Array:
    """Weights (W, 3) that turn a reflectance (W,) into a colour in linear Rec. 709, as the weighted sum over the wavelengths. A
    reflectance of 1 gives (1, 1, 1)."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    xyz = np.array([np.ravel(mitsuba.cie1931_xyz(w)) for w in wavelength]).astype(np.float64)
    xyz *= np.array([mitsuba.cie_d65(w) for w in wavelength], dtype=np.float64).reshape(-1, 1)
    x, y = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]]).T  # the primaries of ITU-R BT.709
    primaries = np.array([x / y, np.ones(3), (1 - x - y) / y])
    primaries = primaries * np.linalg.solve(primaries, xyz.sum(0))
    weights: Array = np.linalg.solve(primaries, xyz.T).T
    return weights


def colour(spectrum: Spectrum, cos: Array = COS) -> Array:
    """Returns the metal's reflectance (A, 3) in linear Rec. 709 at each of the A angles."""
    wavelength = np.arange(360.0, 831.0)
    eta, k = (np.interp(wavelength, spectrum.wavelength, values) for values in (spectrum.eta, spectrum.k))
    return reflectance(eta, k, cos[:, None]) @ rgb_weights(wavelength)


def fit(spectrum: Spectrum) -> Fit:
    """Fits (eta, k) to each channel of the spectrum's colour."""
    curves = colour(spectrum)
    # A colour outside Rec. 709, as that of gold, has a channel with a reflectance above 1. Its best fit would be eta = 0 or an
    # infinite k. So eta and k are limited to the least eta and the largest k that the metal has in visible light.
    wavelength = np.arange(380.0, 781.0)
    seen = np.log([np.interp(wavelength, spectrum.wavelength, values) for values in (spectrum.eta, spectrum.k)])
    least_eta, most_k = float(seen[0].min()), float(seen[1].max())
    eta, k = np.array([_least_squares(curve, seen.mean(1), least_eta, most_k) for curve in curves.T]).T
    missed = reflectance(eta, k, COS[:, None]) - curves
    rms = np.sqrt((COS[:, None] * missed**2).sum(0) / COS.sum())
    return Fit(eta, k, curves[0], rms, np.abs(missed).max(0))


def _least_squares(curve: Array, start: Array, least_eta: float, most_k: float) -> Array:
    """Returns (eta, k) by the Levenberg-Marquardt method, which works on their logarithms. start (2,): logarithms of the first
    guess; the bounds are logarithms too."""

    def residuals(logs: Array) -> Array:
        eta, k = np.exp(logs)
        missed: Array = np.sqrt(COS) * (reflectance(eta, k, COS) - curve)
        return missed

    logs, damping = start, 1e-3
    now = residuals(logs)
    for _ in range(300):
        slope = np.array([residuals(logs + step) - residuals(logs - step) for step in 1e-6 * np.eye(2)]).T / 2e-6
        square = slope.T @ slope
        step = np.linalg.solve(square + damping * np.diag(np.diag(square)), -slope.T @ now)
        tried = logs + np.clip(step, -0.5, 0.5)
        tried = np.array([max(tried[0], least_eta), min(tried[1], most_k)])
        new = residuals(tried)
        if new @ new < now @ now:
            logs, now, damping = tried, new, damping / 4
        else:
            damping *= 4
        if damping > 1e12:
            break
    result: Array = np.exp(logs)
    return result


def rounded(values: Array) -> list[float]:
    """Returns the values rounded to four digits, as presets have them."""
    return [float(f"{value:.4g}") for value in values]


def main(folder: Path) -> int:
    missing = [str(folder / name) for name in FILES.values() if not (folder / name).exists()]
    if missing:
        sys.exit("make-conductors: no such file: " + ", ".join(missing))
    differ = []
    print("| preset | eta | k | colour at normal incidence | its fit's | rms residual | largest residual |")
    print("|---|---|---|---|---|---|---|")
    for name, file in FILES.items():
        fitted = fit(from_yml(folder / file))
        eta, k = rounded(fitted.eta), rounded(fitted.k)
        fitted_f0 = reflectance(np.array(eta), np.array(k), np.ones(3))
        colours = [" ".join(f"{value:.3f}" for value in values) for values in (fitted.f0, fitted_f0)]
        misses = [" ".join(f"{value:.4f}" for value in values) for values in (fitted.rms, fitted.largest)]
        print(f"| `{name}` | {eta} | {k} | " + " | ".join([*colours, *misses]) + " |")
        held = preset(name)
        if (held["eta"], held["k"]) != (eta, k):
            differ.append(name)
    if differ:
        print(f"make-conductors: these presets hold other figures: {', '.join(differ)}", file=sys.stderr)
    return 1 if differ else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: script/make-conductors FOLDER    (database/data of refractiveindex.info-database)")
    sys.exit(main(Path(sys.argv[1])))
