"""Reading: the samples of a file of measured reflectance, in any of the formats of glshade/measured/formats."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from glshade.errors import AssetError
from glshade.files import read_bytes
from glshade.limits import LARGEST_MEASURED
from glshade.measured.formats import FORMATS, MeasuredFile
from glshade.measured.samples import Grid, Measurement, Samples

# The largest reflectance [1/sr] that a file may hold. That of a highlight one thousandth of a degree wide is 3e9.
LARGEST_VALUE = 1e12


def file_bytes(path: Path) -> bytes:
    """Returns the bytes of a file of measured reflectance. Errors: AssetError, one line that starts with the path."""
    try:
        return read_bytes(path, LARGEST_MEASURED)
    except FileNotFoundError:
        raise AssetError(f"{path}: there is no such file") from None
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror}") from None


def read(path: Path, data: bytes | None = None) -> Measurement:
    """Returns what a file of measured reflectance holds.

    data: the bytes of the file, where they have been read already.
    Errors: AssetError, one line that starts with the path, where the file is missing, damaged or of no known format.
    """
    file = MeasuredFile(path, file_bytes(path) if data is None else data)
    name = _format_of(file)
    try:
        measurement = FORMATS[name]().read(file)
    except MemoryError:
        raise file.fail("reading this file takes more memory than there is") from None
    _check(file, measurement)
    return measurement


def _format_of(file: MeasuredFile) -> str:
    """Returns the name of the file's format: by its content, or else by its suffix. Errors: AssetError."""
    for name in FORMATS:
        if FORMATS[name]().recognises(file.data):
            return name
    suffix = file.path.suffix.lower().removeprefix(".")
    if suffix in FORMATS:
        return suffix
    known = "; ".join(described for name in FORMATS if (described := FORMATS[name].description))
    raise file.fail(f"is of no known format of measured reflectance; these are read: {known}")


def _check(file: MeasuredFile, measurement: Measurement) -> None:
    """Refuses a measurement without samples, and values of f that no surface has. Errors: AssetError."""
    f = measurement.f
    known = ~np.isnan(f) if isinstance(measurement, Grid) else np.isfinite(f)
    if not f.size or not known.any():
        raise file.fail("holds no samples above the horizon")
    if isinstance(measurement, Samples) and not known.all():
        raise file.fail(f"sample {int(np.argmin(known.all(axis=1))) + 1} is not a finite number")
    # The known values are not copied, because those of a grid take 35 MB.
    largest = float(np.max(f, where=known, initial=0.0))
    if not largest <= LARGEST_VALUE:
        raise file.fail(f"holds a reflectance of {largest:.3g} per steradian, which no surface has; is it damaged?")
    if largest <= 0:
        raise file.fail("holds no light: every sample is 0")
