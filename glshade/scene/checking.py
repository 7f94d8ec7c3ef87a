"""Checking: refuses documents whose values no scene can use, before anything is made of them.

A file may hold numbers, texts and nested tables that Python reads and that NumPy, pydantic or a terminal cannot handle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from glshade.errors import figure, is_printable
from glshade.limits import DEEPEST_DOCUMENT, LARGEST_NUMBER, MOST_FAULTS, SMALLEST_NUMBER

# Whole numbers from -LARGEST_INTEGER to LARGEST_INTEGER fit into 64 bits.
LARGEST_INTEGER = (1 << 63) - 1


def faults(document: Any) -> list[tuple[tuple[str | int, ...], str]]:
    """Returns the faults of single values as pairs (key path, message), at most MOST_FAULTS of them.

    document: nested tables and lists, as they were read from a file.
    """
    return [fault for fault, _ in zip(_faults(document), range(MOST_FAULTS), strict=False)]


def _faults(document: Any) -> Iterator[tuple[tuple[str | int, ...], str]]:
    # A stack in place of recursion: a file may nest lists deeper than Python's stack.
    waiting: list[tuple[tuple[str | int, ...], Any]] = [((), document)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, Mapping | list | tuple) and len(place) >= DEEPEST_DOCUMENT:
            yield place[:3], f"nests lists and tables more than {DEEPEST_DOCUMENT} deep"
        elif isinstance(value, Mapping):
            for key in value:
                if not is_printable(str(key)):
                    yield place, f"a key has characters that cannot be printed: {str(key)[:40]}"
            waiting += [((*place, key), item) for key, item in reversed(list(value.items()))]
        elif isinstance(value, list | tuple):
            waiting += [((*place, index), item) for index, item in reversed(list(enumerate(value)))]
        else:
            message = _fault_of(value, place)
            if message is not None:
                yield place, message


def _fault_of(value: Any, place: tuple[str | int, ...]) -> str | None:
    """Returns the fault of a value that is neither a table nor a list; None if it has none. place: its key path."""
    if isinstance(value, str) and place != ("description",) and not is_printable(value):
        return f"has characters that cannot be printed: {value[:40]}"
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        return f"is a whole number with {value.bit_length()} bits; at most 63 are allowed"
    # NaN and infinity are refused later, together with the name of the key's type.
    if isinstance(value, float) and value and value - value == 0 and not SMALLEST_NUMBER <= abs(value) <= LARGEST_NUMBER:
        return f"must be 0, or from {SMALLEST_NUMBER:g} to {LARGEST_NUMBER:g} in absolute value, not {figure(value)}"
    return None
