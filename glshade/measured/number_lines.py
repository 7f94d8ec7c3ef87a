"""Number lines: the numbers of a text file, line by line, with messages that name the line."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator
from typing import Any

import numpy as np

from glshade.arrays import Float64
from glshade.limits import LARGEST_MEASURED_TEXT
from glshade.measured.formats import MeasuredFile

# The longest line [bytes]: its words take about 30 times as much memory. A sample of 2000 wavelengths takes 40 kB.
LONGEST_LINE = 1 << 20
# The samples of a file: a table of 200,000 takes 25 s and 500 MB to make.
MOST_SAMPLES = 200_000


def text_lines(file: MeasuredFile) -> Iterator[tuple[int, str]]:
    """Yields (number of the line, text without blanks around it) of the lines that are not empty. Errors: AssetError."""
    if len(file.data) > LARGEST_MEASURED_TEXT:
        raise file.fail(f"has {len(file.data):,} bytes, more than the {LARGEST_MEASURED_TEXT:,} of a text that is read")
    if b"\0" in file.data:
        raise file.fail("is not a text file: it holds a zero byte")
    start, number = 0, 0
    while start < len(file.data):
        # One line at a time: a list of all lines would take several times the memory of the file.
        end = file.data.find(b"\n", start)
        end = len(file.data) if end < 0 else end
        number += 1
        if end - start > LONGEST_LINE:
            raise file.fail(f"has {end - start:,} bytes, more than the {LONGEST_LINE:,} of a line that is read", number)
        line = file.data[start:end].decode("utf-8", "replace").strip()
        start = end + 1
        if line:
            yield number, line


def numbers(file: MeasuredFile, line: int, text: str) -> list[float]:
    """Returns the numbers of one line. Errors: AssetError, with the line, for a word that is not a finite number."""
    found = []
    for word in text.split():
        try:
            value = float(word) if "_" not in word else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            shown = word if len(word) <= 20 else f"{word[:20]} ..."
            raise file.fail(f'"{shown}" is not a finite number', line)
        found.append(value)
    return found


class Rows:
    """Numbers that are collected in rows of a fixed width, with the line on which each row begins."""

    def __init__(self, file: MeasuredFile, width: int) -> None:
        """width: the number of numbers in a row."""
        self._file, self._width = file, width
        self._values, self._lines, self._last = array("d"), array("L"), 0

    def add(self, line: int, found: list[float]) -> None:
        """Adds the numbers of one line."""
        for index in range(len(found)):
            if (len(self._values) + index) % self._width == 0:
                self._lines.append(line)
        if len(self._lines) > MOST_SAMPLES:
            raise self._file.fail(f"holds more than {MOST_SAMPLES:,} samples, the most of which a table is made", line)
        self._values.extend(found)
        self._last = line

    def line(self, row: int) -> int:
        """Returns the number of the line on which a row begins."""
        return self._lines[row]

    def array(self) -> Float64:
        """Returns the rows (N, width). Errors: AssetError where there is none, or the last one is incomplete."""
        if not self._values:
            raise self._file.fail("holds no samples")
        if missing := -len(self._values) % self._width:
            raise self._file.fail(
                f"ends within a sample: {missing} of its {self._width} numbers are missing; is the file cut short?", self._last
            )
        return np.array(self._values, dtype=np.float64).reshape(-1, self._width)

    def refuse(self, wrong: Any, message: str) -> None:
        """Raises an AssetError that names the line of the first row for which `wrong` (N,) holds, if there is one."""
        if np.any(wrong):
            raise self._file.fail(message, self.line(int(np.argmax(wrong))))
