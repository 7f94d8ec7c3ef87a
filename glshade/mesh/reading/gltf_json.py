"""glTF JSON: reads the values of a glTF file's JSON. Every fault names the place, for example materials[3].alphaCutoff."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from glshade.mesh.reading.file import MeshFile, short

# Numbers beyond this become infinite in float32, or in a sum or a product of a few of them.
LARGEST = 1e30


@dataclass(frozen=True)
class Table:
    """An object of a glTF file's JSON.

    file: the file, for messages.
    value: the JSON; a table that the file leaves out is empty.
    place: its place in the file, for messages.
    """

    file: MeshFile
    value: dict[str, Any]
    place: str

    def at(self, key: str) -> str:
        """Returns the place of a value."""
        return f"{self.place}.{key}" if self.place else key

    def has(self, key: str) -> bool:
        """Returns whether the table holds a value under a key."""
        return self.value.get(key) is not None

    def table(self, key: str) -> Table:
        """Returns a table; an empty one where it is left out. Errors: AssetError for a value that is no object."""
        value = self.value.get(key)
        if value is not None and not isinstance(value, dict):
            raise self.fault(key, "an object")
        return Table(self.file, value or {}, self.at(key))

    def item(self, key: str, index: int) -> Table:
        """Returns the table at an index of a list. Errors: AssetError for a shorter list, or a value of another type."""
        values = self.value.get(key, [])
        if not isinstance(values, list):
            raise self.fault(key, "a list")
        place = f"{self.at(key)}[{index}]"
        if not 0 <= index < len(values):
            raise self.file.fail(f"{place} does not exist; the file has {len(values)} {key}")
        if not isinstance(values[index], dict):
            raise self.file.fail(f"{place} must be an object, not {_shown(values[index])}")
        return Table(self.file, values[index], place)

    def index(self, key: str) -> int | None:
        """Returns an index, which is a whole number from 0; None where it is left out. Errors: AssetError."""
        value = self.value.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value % 1 or value < 0:
            raise self.fault(key, "an index: a whole number from 0")
        return int(value)

    def text(self, key: str, default: str) -> str:
        """Returns a text. Errors: AssetError for a value of another type."""
        value = self.value.get(key, default)
        if not isinstance(value, str):
            raise self.fault(key, "a text")
        return value

    def number(self, key: str, default: float, low: float = -LARGEST, high: float = LARGEST) -> float:
        """Returns a number. One outside [low, high] is clamped, with a warning. Errors: AssetError for NaN and other types."""
        if not self.has(key):
            return default
        if not _is_number(self.value[key]):
            raise self.fault(key, "a finite number")
        return self._clamped(key, float(self.value[key]), low, high)

    def numbers(self, key: str, default: Sequence[float], low: float = -LARGEST, high: float = LARGEST) -> list[float]:
        """Returns as many numbers as the default has. Numbers outside [low, high] are clamped, with a warning.

        Errors: AssetError for another count, for NaN and for other types.
        """
        if not self.has(key):
            return list(default)
        values = self.value[key]
        if not isinstance(values, list) or len(values) != len(default) or not all(map(_is_number, values)):
            raise self.fault(key, f"a list of {len(default)} finite numbers")
        return [self._clamped(key, float(value), low, high) for value in values]

    def _clamped(self, key: str, value: float, low: float, high: float) -> float:
        result = min(max(value, low), high)
        if result != value:
            which = "less than" if value < low else "more than"
            self.file.warn(f"{self.at(key)} is {value!r}, {which} {result:g}; {result:g} is used")
        return result

    def fault(self, key: str, expected: str) -> Exception:
        """Returns the error to raise for a value that is not as expected."""
        return self.file.fail(f"{self.at(key)} must be {expected}, not {_shown(self.value.get(key))}")


def _is_number(value: Any) -> bool:
    """Returns whether a value of JSON is a finite number. Whole numbers may be too large for a float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= 1e300 if isinstance(value, int) else math.isfinite(value)


def _shown(value: Any) -> str:
    """Returns a value of JSON for a message."""
    return short(json.dumps(value))
