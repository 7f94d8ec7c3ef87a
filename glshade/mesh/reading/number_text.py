"""Number text: parses text that consists of numbers with spaces and line ends between them."""

from __future__ import annotations

import math

import numpy as np

from glshade.arrays import Float64
from glshade.errors import printable


def numbers(text: bytes, first_line: int = 1) -> tuple[Float64, str]:
    """Returns the numbers (N,) of a text up to the first word that is none, and a message about that word.

    first_line: the number of the text's first line in its file, for the message.
    The message is empty where all words are numbers. "nan" and "inf" are numbers.
    """
    if not text.strip():  # NumPy makes a -1 of a text without words
        return np.empty(0), ""
    try:
        return np.fromstring(text, sep=" "), ""
    except ValueError:
        return _up_to_the_first_error(text, first_line)


def _up_to_the_first_error(text: bytes, first_line: int) -> tuple[Float64, str]:
    """Returns the same as `numbers`, slowly: word by word."""
    values: list[float] = []
    for number, line in enumerate(text.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n"), first_line):
        for word in line.split():
            try:
                values.append(float(word))
            except ValueError:
                # Microsoft's C library writes NaN as "-1.#IND" or "-nan(ind)", and infinity as "1.#INF".
                if b"#" not in word and b"nan" not in word.lower():
                    return np.array(
                        values
                    ), f"line {number}: '{printable(word[:40].decode('ascii', 'backslashreplace'))}' is not a number"
                values.append(math.nan)
    return np.array(values), ""
