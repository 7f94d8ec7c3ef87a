"""Contents: the numbers and texts of one picture file, on their way into the file or out of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class PictureContents:
    """The numbers and texts of one picture file.

    pixels: (H, W, C) uint8 or float32, row 0 at the top. Reading gives 8-bit codes as they are, larger integers divided by the
        largest value of their type, and floats as they are.
    encoding: "srgb", "linear", or the colour interop id of another colour space.
    premultiplied: True where the colours are multiplied by alpha.
    channels: optional names of the C channels; by default R, G, B, A.
    attributes: texts about the picture, by name. Reading leaves them out.
    matrices: matrices (4, 4) about the picture, by OpenEXR's names, for row vectors. Only formats with `matrices` hold them.
    corner: x, y of the pixels' top left corner in the whole picture [pixels].
    whole: width, height of the picture that the pixels were cropped from [pixels]; None where they are all of it.
    """

    pixels: NDArray[Any]
    encoding: str
    premultiplied: bool
    channels: Sequence[str] | None = None
    attributes: Mapping[str, str] = field(default_factory=dict)
    matrices: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    corner: tuple[int, int] = (0, 0)
    whole: tuple[int, int] | None = None

    @property
    def has_alpha(self) -> bool:
        """Whether the last channel is alpha: of two or four channels, it is."""
        return self.pixels.shape[2] in (2, 4)


@dataclass(frozen=True, eq=False)
class Part:
    """One part of a picture file, as its header describes it. Most files have one part; OpenEXR and TIFF may have several.

    name: the part's name; empty where the file gives none.
    channels: the names of the C channels, such as R or normal.X.
    size: width, height of the stored pixels [pixels].
    corner: x, y of their top left corner in the whole picture [pixels].
    whole: width, height of the whole picture [pixels].
    orientation: Exif's number, from 1 to 8, of the turn or mirroring with which the picture is meant to be shown; 1 is none.
    floats: True where the part holds floats, False where it holds 8-bit codes.
    read: returns the pixels, (H, W, C) uint8 or float32, row 0 at the top. Errors: OSError, with the reason as its text.
    """

    name: str
    channels: tuple[str, ...]
    size: tuple[int, int]
    corner: tuple[int, int]
    whole: tuple[int, int]
    orientation: int
    floats: bool
    read: Callable[[], NDArray[Any]]
