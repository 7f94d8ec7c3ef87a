"""Camera formats: one module each, found by its presence and named as `--cameras-format` names it. No list names it.

The module `nerf` holds the class `Nerf`, which derives from CameraFormat.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from glshade.found import Found

if TYPE_CHECKING:
    from glshade.calibration.calibration import CalibratedPicture


class CameraFormat:
    """A format of files that say how pictures were seen.

    folder: True where the cameras are several files in a folder, False where they are one file.
    orthographic: True where orthographic cameras can be written.
    """

    folder: ClassVar[bool] = False
    orthographic: ClassVar[bool] = False

    def texts(self, pictures: Sequence[CalibratedPicture]) -> dict[str, str]:
        """Returns the text of each file to write, by its name; "" is the name of the only file of a format without a folder."""
        raise NotImplementedError

    def read(self, path: Path) -> list[CalibratedPicture]:
        """Returns the pictures of a file or folder.

        Errors: AssetError, one line that starts with the path. KeyError for a key that is missing, or OSError, which `read` of
        glshade/calibration/file.py turns into an AssetError.
        """
        raise NotImplementedError

    def recognises(self, path: Path) -> bool:
        """Returns whether a file or folder looks as if it had this format."""
        raise NotImplementedError


FORMATS: Found[CameraFormat] = Found("glshade.calibration.formats", Path(__file__).parent)
