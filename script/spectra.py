"""Writes the tables of glshade/optics/tables from the data sets of the package colour-science. script/make-spectra calls it.

The data sets are those of the CIE: the colour-matching functions of the 1931 2-degree observer (CIE 018:2019), and the relative
powers of the illuminants D65, FL2 and FL11 (CIE 015:2018). The package's table of D65 ends at 780 nm. From there on it is
continued to 830 nm by the sum of the components of daylight, as CIE 015 defines it. Illuminant A has a formula, which glshade
computes itself.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np

TABLES = Path(__file__).resolve().parent.parent / "glshade" / "optics" / "tables"
# The factors of the second and the third component of daylight for D65, rounded to three digits as CIE 015 prescribes.
M1, M2 = -0.296, -0.688
# The largest difference allowed between that sum and the published table. The factors' rounding alone makes 0.05 of 100.
AGREES = 0.1


def write(name: str, title: str, columns: str, table: np.ndarray) -> None:
    """Writes a table (N, K), whose first column is the wavelength [nm], with a comment that says where it comes from."""
    rows = [",".join(f"{value:.10g}" for value in row) for row in table]
    text = f"# {title}. Source: colour-science 0.4.7 (BSD-3-Clause), from the tables of the CIE.\n# {columns}\n"
    (TABLES / name).write_text(text + "\n".join(rows) + "\n", encoding="utf-8")
    print(f"{name}: {len(rows)} rows from {table[0, 0]:g} to {table[-1, 0]:g} nm")


def main() -> int:
    warnings.simplefilter("ignore")  # the package warns of optional packages that are missing
    import colour

    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    write(
        "observer.csv",
        "CIE 1931 2-degree standard observer",
        "wavelength [nm], x, y, z",
        np.column_stack([observer.wavelengths, observer.values]),
    )
    components = list(colour.colorimetry.SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES.values())
    wavelengths = components[0].wavelengths
    daylight = np.column_stack([component.values for component in components]) @ [1.0, M1, M2]
    published = colour.SDS_ILLUMINANTS["D65"]
    difference = np.abs(np.interp(published.wavelengths, wavelengths, daylight) - published.values).max()
    if difference > AGREES:
        print(f"make-spectra: the sum of the components differs from the table of D65 by {difference:g}", file=sys.stderr)
        return 1
    beyond = wavelengths > published.wavelengths[-1]
    d65 = np.column_stack(
        [np.append(published.wavelengths, wavelengths[beyond]), np.append(published.values, daylight[beyond])]
    )
    write("D65.csv", "CIE standard illuminant D65", "wavelength [nm], relative power", d65)
    for name, published_name in (("F2", "FL2"), ("F11", "FL11")):
        lamp = colour.SDS_ILLUMINANTS[published_name]
        write(
            f"{name}.csv",
            f"CIE illuminant {published_name}",
            "wavelength [nm], relative power",
            np.column_stack([lamp.wavelengths, lamp.values]),
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
