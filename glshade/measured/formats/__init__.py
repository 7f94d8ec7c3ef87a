"""Formats of measured reflectance: one module each, found by its presence. No list names it.

The module `brdf` holds the class `Brdf`, which derives from MeasuredFormat and reads files that end in .brdf.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from glshade.errors import AssetError
from glshade.found import Found

if TYPE_CHECKING:
    from glshade.measured.samples import Measurement


class MeasuredFile:
    """A file of measured reflectance that is being read.

    path: the file.
    data: its bytes.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data = path, data

    def fail(self, message: str, line: int | None = None) -> AssetError:
        """Returns the error for a fault of the file. line: the number of the line with the fault; None for the whole file."""
        return AssetError(f"{self.path}: {message}" if line is None else f"{self.path}:{line}: {message}")


class MeasuredFormat:
    """A format of files that hold measured reflectance.

    description: the format in words, for messages.
    """

    description: ClassVar[str] = ""

    def recognises(self, data: bytes) -> bool:
        """Returns whether a file with these bytes looks as if it had this format."""
        raise NotImplementedError

    def read(self, file: MeasuredFile) -> Measurement:
        """Returns what the file holds. Errors: AssetError, one line that starts with the path."""
        raise NotImplementedError


FORMATS: Found[MeasuredFormat] = Found("glshade.measured.formats", Path(__file__).parent)
