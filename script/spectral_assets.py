"""Makes the spectra that scenes/ uses, scenes/assets/*.spd and *.csv. script/make-assets calls it.

Two paints that look alike by day and differ under a fluorescent tube; an optical brightener; an ultraviolet lamp. Only the
indices of gold and copper are measured.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from glshade.optics.observer import WAVELENGTHS, daylight, rgb_weights, sampled
from glshade.optics.spectra import Spectrum
from glshade.optics.upsampling import spectrum_of

Array = NDArray[np.float64]

# The wavelengths of the tables [nm].
STEPS = np.arange(380.0, 781.0, 5.0)
# The colour of both paints by day.
BY_DAY = (0.30, 0.27, 0.20)
# The reflectances of the second paint, and how much they may change from one wavelength to the next. Paints are smooth.
LEAST, MOST, SLOPE = 0.02, 0.9, 0.035
# Wavelength [nm], then eta and k of gold and of copper, as Johnson and Christy 1972 measured them (Phys. Rev. B 6, 4370). The
# numbers are those of refractiveindex.info, which are in the public domain (CC0).
METALS = np.array(
    [
        (300.9, 1.53, 1.889, 1.40, 1.679),
        (310.7, 1.53, 1.893, 1.38, 1.729),
        (320.4, 1.54, 1.898, 1.38, 1.783),
        (331.5, 1.48, 1.883, 1.34, 1.821),
        (342.5, 1.48, 1.871, 1.36, 1.864),
        (354.2, 1.50, 1.866, 1.37, 1.916),
        (367.9, 1.48, 1.895, 1.36, 1.975),
        (381.5, 1.46, 1.933, 1.33, 2.045),
        (397.4, 1.47, 1.952, 1.32, 2.116),
        (413.3, 1.46, 1.958, 1.28, 2.207),
        (430.5, 1.45, 1.948, 1.25, 2.305),
        (450.9, 1.38, 1.914, 1.24, 2.397),
        (471.4, 1.31, 1.849, 1.25, 2.483),
        (495.9, 1.04, 1.833, 1.22, 2.564),
        (520.9, 0.62, 2.081, 1.18, 2.608),
        (548.6, 0.43, 2.455, 1.02, 2.577),
        (582.1, 0.29, 2.863, 0.70, 2.704),
        (616.8, 0.21, 3.272, 0.30, 3.205),
        (659.5, 0.14, 3.697, 0.22, 3.747),
        (704.5, 0.13, 4.103, 0.21, 4.205),
        (756.0, 0.14, 4.542, 0.24, 4.665),
        (821.1, 0.16, 5.083, 0.26, 5.180),
        (892.0, 0.17, 5.663, 0.30, 5.768),
    ]
)


def metamers() -> tuple[Array, Array]:
    """Returns two reflectances (81,) with one colour by day. The second is as red as can be under the lamp F11."""
    first = np.interp(STEPS, WAVELENGTHS, spectrum_of(BY_DAY))
    # A table is linear between its rows, so that its colour is a sum over the rows.
    parts = np.stack([sampled(STEPS, row) for row in np.eye(len(STEPS))])
    by_day = parts @ (daylight()[:, None] * rgb_weights())
    by_lamp = parts @ (Spectrum(spectrum="F11").light()[:, None] * rgb_weights())
    change = np.diff(np.eye(len(STEPS)), axis=0)
    found = linprog(
        by_lamp[:, 1] - by_lamp[:, 0],
        A_ub=np.concatenate([change, -change]),
        b_ub=np.full(2 * len(change), SLOPE),
        A_eq=by_day.T,
        b_eq=first @ by_day,
        bounds=(LEAST, MOST),
    )
    return first, found.x


def bell(wavelengths: Array, centre: float, width: float) -> Array:
    """Returns a Gaussian with 1 at its centre. width: its standard deviation [nm]."""
    return np.asarray(np.exp(-0.5 * ((wavelengths - centre) / width) ** 2))


def brightener() -> tuple[Array, Array, Array]:
    """Returns the exciting wavelengths (N,) [nm], the emitted ones (M,) [nm], and the yield (N, M) [1/nm] of an optical
    brightener: it takes in up to 80 % of the light round 360 nm, and gives off 85 % of that energy round 440 nm.
    """
    excitation, emission = np.arange(300.0, 421.0, 10.0), np.arange(420.0, 561.0, 5.0)
    spread = bell(emission, 440.0, 12.0) + 0.5 * bell(emission, 465.0, 22.0)
    spread = np.where(emission > 420, spread, 0.0)
    spread /= np.trapezoid(spread, emission)
    return excitation, emission, 0.8 * 0.85 * np.outer(bell(excitation, 360.0, 22.0) * (excitation < 420), spread)


def write(path: Path, title: str, rows: list[str]) -> None:
    path.write_text(f"# {title}. Made by script/make-assets.\n" + "\n".join(rows) + "\n", encoding="utf-8")
    print(path)


def main(folder: Path) -> None:
    for name, values in zip(("metamer-1.spd", "metamer-2.spd"), metamers(), strict=True):
        rows = [f"{wavelength:g} {value:.5f}" for wavelength, value in zip(STEPS, values, strict=True)]
        write(folder / name, "Reflectance of a paint: wavelength [nm], value", rows)
    excitation, emission, values = brightener()
    first = "excitation \\ emission [nm]," + ",".join(f"{wavelength:g}" for wavelength in emission)
    rows = [
        f"{wavelength:g}," + ",".join(f"{value:.6f}" for value in row)
        for wavelength, row in zip(excitation, values, strict=True)
    ]
    write(folder / "brightener.csv", "Yield of an optical brightener [1/nm]", [first, *rows])
    for column, name in enumerate(("gold-eta", "gold-k", "copper-eta", "copper-k"), 1):
        rows = [f"{row[0]:g} {row[column]:g}" for row in METALS]
        write(folder / f"{name}.spd", "Johnson and Christy 1972, by refractiveindex.info (CC0): wavelength [nm], value", rows)
    # Ultraviolet light ends at 400 nm. The paper takes it in, and reflects visible light.
    paper = [(300, 0.05), (340, 0.06), (370, 0.10), (390, 0.25), (410, 0.62), (430, 0.76), (500, 0.80), (780, 0.84)]
    write(folder / "paper.spd", "Reflectance of paper: wavelength [nm], value", [f"{x} {y}" for x, y in paper])
    # The observer sees nothing below 360 nm.
    lamp = np.arange(330.0, 356.0, 5.0)
    rows = [f"{wavelength:g} {value:.5f}" for wavelength, value in zip(lamp, bell(lamp, 343.0, 6.0), strict=True)]
    write(folder / "ultraviolet.spd", "Power of an ultraviolet lamp: wavelength [nm], relative power", rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
