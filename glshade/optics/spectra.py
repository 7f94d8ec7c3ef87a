"""Spectra: values by wavelength in place of three numbers. Reflectances, refractive indices and lights may have one."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, ValidationInfo, WithJsonSchema

from glshade.document import LONGEST_NAME, Document, Finite, fault, nearest, number, received, resolved, value_of
from glshade.errors import AssetError, figure
from glshade.files import read_text
from glshade.limits import LARGEST_NUMBER, SMALLEST_NUMBER
from glshade.optics.observer import WAVELENGTHS, daylight, matching, rgb_weights, sampled, table

Array = NDArray[np.float64]

# The second radiation constant h c / k [nm K], rounded as in Planck's law of CIE 015, and the one that defines illuminant A.
C2, C2_OF_A = 1.4388e7, 1.435e7
# The temperature of illuminant A on the scale of 1931 [K].
KELVIN_OF_A = 2848.0
# The names of lights that a scene may use. A is computed, the others are tables.
ILLUMINANTS = ("A", "D65", "F2", "F11")
# The largest file of a spectrum [bytes], and the number of its rows. An instrument's file with a row for each 0.1 nm from
# 200 nm to 2500 nm has 23,000 rows and 400 kB.
LARGEST_SPECTRUM, MOST_ROWS = 4 << 20, 100_000
# A light whose luminance is a smaller share than this of the luminance of D65 with the same power counts as invisible.
INVISIBLE = 1e-3
# Colours that are computed from spectra are rounded to this number of decimal places, so that greys are exactly grey.
DIGITS = 12
# The temperatures of blackbodies [K]: at 500 K a body begins to glow, and the colour no longer changes far above 1e5 K.
COLDEST, HOTTEST = 500.0, 1e6

# The keys of which a spectrum has one.
SOURCES = ("spectrum", "blackbody")

Rows = tuple[tuple[float, float], ...]


def _source(value: Any, info: ValidationInfo) -> Any:
    """Returns the name of an illuminant, the path of a table, or the rows of a table."""
    if value is None or (isinstance(value, str) and value in ILLUMINANTS):
        return value
    if isinstance(value, str | Path):
        if isinstance(value, str) and re.fullmatch(r"\w+", value) and not (_folder(info) / value).exists():
            raise fault(f'no file and no illuminant is named "{value}"' + nearest(value, ILLUMINANTS))
        path = resolved(Path(value), info)
        try:
            rows_of(path)
        except AssetError as error:
            raise fault("; ".join(error.problems)) from None
        return path
    return _rows(value)


def _folder(info: ValidationInfo) -> Path:
    return Path((info.context or {}).get("folder") or ".")


def _rows(value: Any) -> Rows:
    """Returns the rows of a table that is written in the scene itself."""
    if isinstance(value, bool | int | float) or not hasattr(value, "__len__"):
        raise fault("must be a name, a file, or a list of pairs [nm, value]" + received(value))
    rows = []
    for index, row in enumerate(value):
        if not isinstance(row, Sequence | np.ndarray) or isinstance(row, str) or len(row) != 2:
            raise fault(f"row {index} must be a pair [nm, value]" + received(row))
        rows.append((float(number(row[0])), float(number(row[1]))))
    problem = fault_in(rows, lambda index: f"row {index}")
    if problem:
        raise fault(problem)
    return tuple(rows)


def fault_in(rows: Sequence[tuple[float, float]], place: Callable[[int], str]) -> str | None:
    """Returns the first fault of a table of (wavelength [nm], value); None if it has none.

    place: takes the index of a row and returns its name for the message.
    """
    if len(rows) < 2:
        return f"has {len(rows)} rows of wavelength and value, and a spectrum needs at least two"
    if len(rows) > MOST_ROWS:
        return f"has more than {MOST_ROWS:,} rows"
    before = 0.0
    for index, (wavelength, value) in enumerate(rows):
        if not (math.isfinite(wavelength) and math.isfinite(value)):
            return f"{place(index)} is not a pair of finite numbers"
        if wavelength <= before:
            return f"{place(index)}: wavelengths must ascend from above 0, and {wavelength:g} nm follows {before:g} nm"
        if value < 0:
            return f"{place(index)}: the value at {wavelength:g} nm is negative"
        if value > LARGEST_NUMBER:
            return f"{place(index)}: the value at {wavelength:g} nm is larger than {LARGEST_NUMBER:g}"
        before = wavelength
    if before < WAVELENGTHS[0]:
        return f"ends at {before:g}, before {WAVELENGTHS[0]:g} nm: wavelengths are in nanometres"
    if 0 < max(value for _, value in rows) < SMALLEST_NUMBER:
        return f"has no value of at least {SMALLEST_NUMBER:g}"
    return None


def rows_of(path: Path) -> tuple[Array, Array]:
    """Returns the wavelengths [nm] and the values of a file with two numbers a line, separated by space, comma or semicolon.

    Lines that start with # are comments, and the first other line may hold the names of the columns.
    Errors: AssetError, in one line.
    """
    try:
        found = path.stat()
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror}") from None
    return _rows_of(path, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=256)
def _rows_of(path: Path, changed: int, size: int) -> tuple[Array, Array]:
    """Returns the columns of a file, from the cache unless it has changed. changed, size: its time and size."""
    rows: list[tuple[float, float]] = []
    lines: list[int] = []
    titled = False
    for line, text in enumerate(read_text(path, LARGEST_SPECTRUM, AssetError).splitlines(), 1):
        words = [word for word in re.split(r"[\s,;]+", text.strip()) if word]
        if not words or words[0].startswith("#"):
            continue
        try:
            if len(words) != 2:
                raise ValueError
            rows.append((float(words[0]), float(words[1])))
        except ValueError:
            if rows or titled:
                raise AssetError(f"{path}:{line}: must hold a wavelength [nm] and a value") from None
            titled = True
            continue
        lines.append(line)
        if len(rows) > MOST_ROWS:
            break
    problem = fault_in(rows, lambda index: f"line {lines[index]}")
    if problem:
        raise AssetError(f"{path}: {problem}")
    wavelengths, values = np.array(rows, dtype=np.float64).T
    return wavelengths, values


def _warm(kelvin: float) -> float:
    if not COLDEST <= kelvin <= HOTTEST:
        raise fault(f"must be from {COLDEST:g} to {HOTTEST:g} kelvin, not {figure(kelvin)}")
    return kelvin


class Spectrum(Document):
    """A spectrum in place of a colour: a table, an illuminant of the CIE, or a blackbody."""

    spectrum: Annotated[
        Any,
        PlainValidator(_source),
        WithJsonSchema(
            {
                "anyOf": [
                    {"type": "string"},
                    {
                        "type": "array",
                        "minItems": 2,
                        "items": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
                    },
                ]
            }
        ),
    ] = Field(
        None,
        description='a file of wavelengths [nm] and values, a list of such pairs, or for a light "A", "D65", "F2" or "F11"',
    )
    blackbody: Annotated[float, AfterValidator(_warm), BeforeValidator(number)] | None = Field(
        None, description="for a light: the temperature of a blackbody [K]"
    )
    scale: Annotated[Finite, Field(ge=0)] = Field(1.0, description="multiplies the values")

    @classmethod
    def cross_faults(cls, data: Any) -> Any:
        given = [key for key in SOURCES if value_of(data, key) is not None]
        if len(given) == 2:
            yield ("blackbody",), "cannot be used together with spectrum, since both say how light is spread"
        elif not given and not (isinstance(data, Mapping) and set(data) - set(cls.model_fields)):
            # Another message names a misspelt key, and none is needed beside it.
            yield ("spectrum",), "is required"

    @property
    def is_light(self) -> bool:
        """Whether it can only be the spectrum of a light: an illuminant or a blackbody."""
        return self.blackbody is not None or isinstance(self.spectrum, str)

    @property
    def name(self) -> str:
        """Its name for messages."""
        if self.blackbody is not None:
            return f"a blackbody of {self.blackbody:g} K"
        if isinstance(self.spectrum, Path):
            return self.spectrum.name
        return self.spectrum if isinstance(self.spectrum, str) else "the table"

    @property
    def rows(self) -> tuple[Array, Array]:
        """The wavelengths (N,) [nm] and the values (N,) of the table, without `scale`. Errors: AssetError."""
        if self.blackbody is not None:
            return WAVELENGTHS, planck(self.blackbody, C2)
        if self.spectrum == "A":
            return WAVELENGTHS, planck(KELVIN_OF_A, C2_OF_A)
        if isinstance(self.spectrum, str):
            return table(self.spectrum)[:, 0], table(self.spectrum)[:, 1]
        if isinstance(self.spectrum, Path):
            return rows_of(self.spectrum)
        wavelengths, values = np.array(self.spectrum, dtype=np.float64).T
        return wavelengths, values

    @property
    def ends(self) -> tuple[float, float]:
        """The first and the last wavelength of the table [nm]. Errors: AssetError."""
        wavelengths, _ = self.rows
        return float(wavelengths[0]), float(wavelengths[-1])

    def values(self, held: bool = False) -> Array:
        """Returns the spectrum (531,) of a reflectance or an index. held: as in `sampled`. Errors: AssetError."""
        return self.scale * sampled(*self.rows, held)

    def light(self) -> Array:
        """Returns the spectrum (531,) of a light.

        Its luminance is `scale`. A light that is hardly visible, such as an ultraviolet lamp, has the power of D65 in its
        place, from 300 nm to 830 nm. Errors: AssetError.
        """
        power = sampled(*self.rows)
        if not power.any():
            return power
        luminance = power @ matching()[:, 1]
        as_daylight = power / (power.sum() / daylight().sum())
        visible = as_daylight @ matching()[:, 1] >= INVISIBLE
        return self.scale * (power / luminance if visible else as_daylight)

    def colour(self, lit: bool, held: bool = False) -> tuple[float, float, float]:
        """Returns the colour, linear Rec. 709: that of a light, or that of a reflectance under D65. Errors: AssetError.

        lit: whether it is the spectrum of a reflectance or of an index.
        held: as in `sampled`.
        """
        return colour_of(daylight() * self.values(held) if lit else self.light())


def is_spectrum(value: Any) -> bool:
    """Returns whether a value of the scene file is meant as a spectrum: a table with a key that only spectra have, also where
    that key is misspelt.
    """
    if not isinstance(value, Mapping):
        return isinstance(value, Spectrum)
    if any(key in value for key in SOURCES):
        return True
    # The misspelt key is then named in the message of the error.
    words = [key.lower() for key in value if isinstance(key, str) and len(key) <= LONGEST_NAME]
    return "texture" not in value and any(difflib.get_close_matches(word, SOURCES, n=1) for word in words)


def colour_of(spectrum: Array) -> tuple[float, float, float]:
    """Returns the colour of light of a spectrum (531,), linear Rec. 709."""
    red, green, blue = np.round(spectrum @ rgb_weights(), DIGITS).tolist()
    return red, green, blue


def planck(kelvin: float, c2: float) -> Array:
    """Returns the spectrum (531,) of a blackbody, 1 at 560 nm (Planck 1901). c2: second radiation constant [nm K]."""

    def power(wavelength: Any) -> Any:
        # The exponent stays below 1e2 from 300 nm and 500 K on, so that nothing overflows.
        return 1 / (wavelength**5 * np.expm1(c2 / (wavelength * kelvin)))

    result: Array = power(WAVELENGTHS) / power(560.0)
    return result
