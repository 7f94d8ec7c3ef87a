"""Reradiation: light that a fluorescent surface takes in at one wavelength and gives off at others (Donaldson 1954)."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from glshade.document import Document, Finite, fault, resolved
from glshade.errors import AssetError
from glshade.files import read_text
from glshade.optics.bispectral import read_pixel
from glshade.optics.observer import WAVELENGTHS

Array = NDArray[np.float64]

# The largest file of a matrix [bytes], and the number of its rows and of its columns. Measured matrices go from 300 nm to
# 800 nm in steps of 1 nm at the finest, and then have 251,000 numbers.
LARGEST_MATRIX, MOST_WAVELENGTHS = 16 << 20, 1000


def _readable(path: Path, info: ValidationInfo) -> Path:
    path = resolved(path, info)
    try:
        matrix_of(path)
    except AssetError as error:
        raise fault("; ".join(error.problems)) from None
    return path


class Reradiation(Document):
    """A Donaldson matrix: how much light of each wavelength a surface gives off for light of each other wavelength.

    The surface gives it off evenly in all directions, as a Lambertian surface does.
    """

    file: Annotated[Path, AfterValidator(_readable)] = Field(
        description="CSV: the first row holds the wavelengths of emission [nm], the first column those of excitation [nm], and "
        "the rest the yield, the share of the absorbed and reflected light that is given off [1/nm]; or a bispectral EXR file"
    )
    pixel: tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]] = Field(
        (0, 0), description="column and row of the pixel of an EXR file, from the upper left corner"
    )
    scale: Annotated[Finite, Field(ge=0)] = Field(1.0, description="multiplies the yield")

    @model_validator(mode="after")
    def _has_pixel(self) -> Reradiation:
        if self.pixel != (0, 0):
            try:
                matrix_of(self.file, self.pixel)
            except AssetError as error:
                raise fault("; ".join(error.problems)) from None
        return self

    def matrix(self) -> Array:
        """Returns the yield (531, 531) [1/nm]: a row for each exciting wavelength, a column for each emitted one.

        It is linear between the wavelengths of the table, and 0 beyond them. Errors: AssetError.
        """
        excitation, emission, values = matrix_of(self.file, self.pixel)
        columns = np.stack([np.interp(WAVELENGTHS, emission, row, 0.0, 0.0) for row in values])
        return self.scale * np.stack([np.interp(WAVELENGTHS, excitation, column, 0.0, 0.0) for column in columns.T], axis=1)

    def emitted(self, light: Array) -> Array:
        """Returns the spectrum (531,) that the surface gives off under light of a spectrum (531,). Errors: AssetError."""
        return light @ self.matrix()

    def excess(self, reflectance: Array) -> tuple[float, float] | None:
        """Returns the wavelength [nm] at which the most energy leaves the surface, and its ratio to the energy that arrives, if
        that ratio is above 1; else None. reflectance: the surface's own (531,). Errors: AssetError.
        """
        ratio = reflectance + self.matrix().sum(axis=1)
        worst = int(np.argmax(ratio))
        # A table whose rows are meant to add up to 1 does so within the rounding of its digits.
        return (float(WAVELENGTHS[worst]), float(ratio[worst])) if ratio[worst] > 1 + 1e-6 else None

    def shorter(self) -> tuple[float, float] | None:
        """Returns the exciting wavelength and the emitted one [nm] of the largest yield of waves that are shorter than those
        which excited them; None if there are none. Errors: AssetError.
        """
        excitation, emission, values = matrix_of(self.file, self.pixel)
        wrong = np.where(emission < excitation[:, None], values, 0.0)
        row, column = np.unravel_index(int(np.argmax(wrong)), wrong.shape)
        return (float(excitation[row]), float(emission[column])) if wrong[row, column] > 0 else None


def matrix_of(path: Path, pixel: tuple[int, int] = (0, 0)) -> tuple[Array, Array, Array]:
    """Returns the exciting wavelengths (N,) [nm], the emitted ones (M,) [nm], and the yield (N, M) [1/nm] of a file.

    In a CSV file, numbers are separated by commas or semicolons; the first cell may hold any text; lines that start with # are
    comments.
    pixel: column and row of the pixel of an EXR file.
    Errors: AssetError, in one line.
    """
    try:
        found = path.stat()
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror}") from None
    return _matrix_of(path, pixel, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=64)
def _matrix_of(path: Path, pixel: tuple[int, int], changed: int, size: int) -> tuple[Array, Array, Array]:
    """Returns the table of a file, from the cache unless it has changed. changed, size: its time and size."""
    if path.suffix.lower() == ".exr":
        excitation, emission, values = read_pixel(path, pixel)
    elif pixel != (0, 0):
        raise AssetError(f"{path}: has no pixels; only an EXR file has")
    else:
        excitation, emission, values = _read_csv(path)
    for name, wavelengths in (("emission", emission), ("excitation", excitation)):
        if not np.isfinite(wavelengths).all() or wavelengths[0] <= 0 or not (np.diff(wavelengths) > 0).all():
            raise AssetError(f"{path}: the wavelengths of {name} must ascend from above 0")
        if wavelengths[-1] < WAVELENGTHS[0]:
            raise AssetError(f"{path}: the wavelengths of {name} end before {WAVELENGTHS[0]:g} nm: they are in nanometres")
    bad = np.argwhere(~(np.isfinite(values) & (values >= 0)))
    if len(bad):
        row, column = bad[0]
        raise AssetError(
            f"{path}: the yield from {excitation[row]:g} nm to {emission[column]:g} nm is negative or not a finite number"
        )
    return excitation, emission, values


def _read_csv(path: Path) -> tuple[Array, Array, Array]:
    """Returns the table of a CSV file, as `matrix_of` does, without having looked at its numbers. Errors: AssetError."""
    rows: list[list[float]] = []
    for line, text in enumerate(read_text(path, LARGEST_MATRIX, AssetError).splitlines(), 1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        cells = re.split(r"[,;]", text.strip())
        try:
            rows.append([float(cell) for cell in (cells if rows else cells[1:])])
        except ValueError:
            raise AssetError(f"{path}:{line}: holds a cell that is no number") from None
        if len(rows) > MOST_WAVELENGTHS + 1 or len(cells) > MOST_WAVELENGTHS + 1:
            raise AssetError(f"{path}:{line}: the matrix has more than {MOST_WAVELENGTHS} wavelengths")
        if len(rows) > 1 and len(rows[-1]) != len(rows[0]) + 1:
            raise AssetError(f"{path}:{line}: has {len(rows[-1]) - 1} yields, and the first row {len(rows[0])} wavelengths")
    if len(rows) < 3 or len(rows[0]) < 2:
        raise AssetError(f"{path}: a matrix needs at least two wavelengths of excitation and two of emission")
    table = np.array(rows[1:])
    return table[:, 0], np.array(rows[0]), table[:, 1:]
