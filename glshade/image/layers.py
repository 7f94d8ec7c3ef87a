"""Layers: a picture with what it is made of: lights and lobes that add up to it, and what is known of each pixel's surface."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from glshade.image.image import Image

# What a film may ask for; docs/layers.md says what each is.
AOVS = (
    *("depth", "normal", "view_normal", "position", "uv"),
    *("albedo", "diffuse", "specular", "lights", "background"),
    *("object_id", "material_id", "cryptomatte"),
)
# The names of a layer's channels, where they are not colours: Z, XYZ and UV are what compositing programs call depths, vectors
# and texture coordinates, I is Mitsuba's for an index.
CHANNELS = {
    **{"depth": "Z", "normal": "XYZ", "view_normal": "XYZ", "position": "XYZ", "uv": "UV"},
    **{"object_id": "I", "material_id": "I"},
}


@dataclass(frozen=True, eq=False)
class Layers:
    """image: the picture. arrays: name -> (H, W, C) float32, row 0 at the top, linear and premultiplied where it is a colour.
    attributes: what the layers' file says of them."""

    image: Image
    arrays: dict[str, NDArray[np.float32]]
    attributes: dict[str, str] = field(default_factory=dict)

    @property
    def channels(self) -> tuple[str, ...]:
        """The layers' channels, as an OpenEXR file names them: `normal.X`."""
        return tuple(
            f"{name}.{channel}"
            for name, array in self.arrays.items()
            for channel in CHANNELS.get(name, "RGBA")[: array.shape[2]]
        )

    def save(self, path: str | Path, attributes: Mapping[str, str] | None = None) -> None:
        """Writes the picture with its layers.

        EXR: one file with all of them, the picture in R, G, B (and A). Other extensions: the picture as Image.save has it, and
        its layers beside it in NAME.aovs.exr, which is written first: where there is a picture, its layers are complete.
        attributes: what the picture's file says of itself, too. Errors: GlshadeError.
        """
        from glshade.image.file import check_suffix

        path = Path(path)
        check_suffix(path)
        picture = replace(self.image, attributes={**self.image.attributes, **(attributes or {})})
        if path.suffix.lower() == ".exr" and self.arrays:
            linear = picture.linear()
            self._write(path, (*linear.channels, *self.channels), [linear.pixels, *self.arrays.values()], picture)
            return
        if self.arrays:
            self._write(beside(path), self.channels, list(self.arrays.values()), picture)
        picture.save(path)

    def _write(self, path: Path, channels: tuple[str, ...], arrays: list[NDArray[np.float32]], picture: Image) -> None:
        from glshade.image.file import write

        pixels, attributes = np.concatenate(arrays, axis=2), {**picture.attributes, **self.attributes}
        write(path, pixels, channels=channels, attributes=attributes, corner=picture.corner, whole=picture.whole)


def beside(path: Path) -> Path:
    """Where the layers of a picture lie that has no room for them."""
    return path.with_name(f"{path.stem}.aovs.exr")


def names_attribute(names: list[str]) -> str:
    """A list of names as a file's attribute: JSON."""
    return json.dumps(names, separators=(",", ":"))
