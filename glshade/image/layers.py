"""Layers: a picture, the parts of it that its lights and lobes add, and data about the surface in each pixel."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.image.layer_paths import LayerFormat, layers_path

if TYPE_CHECKING:
    from glshade.image.image import Image

# The layers that a film may ask for; docs/layers.md explains each.
AOVS = (
    "depth",
    "normal",
    "view_normal",
    "position",
    "uv",
    "albedo",
    "diffuse",
    "specular",
    "emission",
    "lights",
    "background",
    "object_id",
    "material_id",
    "semantic_id",
    "mask",
    "cryptomatte",
    "spectrum",
)
# The start of the names of a spectrum's channels, and the attributes of their file (Fichet, Pacanowski and Wilkie 2021).
SPECTRAL = "S0."
SPECTRAL_ATTRIBUTES = {"spectralLayoutVersion": "1.0", "emissiveUnits": "W.m^-2.sr^-1"}
# The channel letters of layers that are not colours. Compositing programs expect Z for a depth, XYZ for a vector and UV for
# texture coordinates; I for an index is Mitsuba's.
CHANNELS = {
    "depth": "Z",
    "normal": "XYZ",
    "view_normal": "XYZ",
    "position": "XYZ",
    "uv": "UV",
    "object_id": "I",
    "material_id": "I",
    "semantic_id": "I",
    "mask": "Y",
}


@dataclass(frozen=True, eq=False)
class Layers:
    """A picture and its layers, all of the same size.

    image: the picture.
    arrays: name -> (H, W, C) float32, row 0 at the top; colours are linear Rec. 709 and premultiplied.
    attributes: texts about the layers, by name, for the EXR file that holds them.
    form: "exr" stores all layers in one file, "png" each in a file of its own.
    depth_scale: depth that one code of a PNG stands for [scene units]; None chooses a round number that fits.
    legends: name of a layer of numbers -> number -> what it stands for, as JSON types.
    """

    image: Image
    arrays: dict[str, NDArray[np.float32]]
    attributes: dict[str, str] = field(default_factory=dict)
    form: LayerFormat = "exr"
    depth_scale: float | None = None
    legends: dict[str, dict[int, Any]] = field(default_factory=dict)

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the layers' channels as an OpenEXR file has them, such as `normal.X`."""
        return tuple(
            name if name.startswith(SPECTRAL) else f"{name}.{channel}"
            for name, array in self.arrays.items()
            for channel in CHANNELS.get(name, "RGBA")[: array.shape[2]]
        )

    def save(self, path: str | Path, attributes: Mapping[str, str] | None = None) -> None:
        """Writes the picture and its layers.

        A format that holds layers (OpenEXR) gets one file, with the picture in the channels R, G, B (and A). In other formats
        Image.save writes the picture, and the layers go to NAME.aovs.exr in the same folder. With the form "png" each layer
        goes to NAME.LAYER.png, and NAME.aovs.json says what the codes mean.
        attributes: optional texts about the picture, added to the image's own, by name.
        Errors: GlshadeError.
        """
        from glshade.image.file import format_of

        path = Path(path)
        picture = replace(self.image, attributes={**self.image.attributes, **(attributes or {})})
        if self.form == "png" and self.arrays:
            from glshade.image.png_layers import Coding, write

            write(path, self.arrays, Coding(self.depth_scale, self.legends), picture)
            picture.save(path)
            return
        if format_of(path).layers and self.arrays:
            linear = picture.linear()
            self._write(path, (*linear.channels, *self.channels), [linear.pixels, *self.arrays.values()], picture)
            return
        # The layers are written first, so that a picture's file implies that its layers are complete.
        if self.arrays:
            self._write(layers_path(path), self.channels, list(self.arrays.values()), picture)
        picture.save(path)

    def _write(self, path: Path, channels: tuple[str, ...], arrays: list[NDArray[np.float32]], picture: Image) -> None:
        """Writes a file of named channels: those of the arrays (H, W, C) in turn. Texts and crop are those of `picture`."""
        from glshade.image.contents import PictureContents
        from glshade.image.file import write

        contents = PictureContents(
            np.concatenate(arrays, axis=2),
            encoding="linear",
            premultiplied=True,
            channels=channels,
            attributes={**picture.attributes, **picture.texts_of_camera, **self.attributes},
            matrices=picture.matrices,
            corner=picture.corner,
            whole=picture.whole,
        )
        write(path, contents)


def spectral_name(wavelength: float) -> str:
    """Returns the name of the channel of a wavelength [nm], such as `S0.550,000000nm`: a dot would separate layers."""
    return SPECTRAL + f"{wavelength:.6f}nm".replace(".", ",")


def wavelength_of(name: str) -> float:
    """Returns the wavelength [nm] in a name of `spectral_name`."""
    return float(name.removeprefix(SPECTRAL).removesuffix("nm").replace(",", "."))


def names_attribute(names: list[str]) -> str:
    """Returns a list of names as the text of a file's attribute, in JSON."""
    return json.dumps(names, separators=(",", ":"))
