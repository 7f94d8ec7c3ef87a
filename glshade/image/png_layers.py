"""PNG layers: stores each layer as a PNG file of whole numbers, and says in a JSON file what the numbers mean.

0 always says that the pixel shows no surface. The JSON text that describes a layer is also stored in the PNG file itself, in
the text `glshade:layer`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.files import replacing
from glshade.image.contents import PictureContents
from glshade.image.file import write as write_file
from glshade.image.layer_paths import legend_path, png_path

if TYPE_CHECKING:
    from glshade.image.image import Image

# The text of a PNG file that describes its layer, in JSON.
LAYER = "glshade:layer"
# The largest code of 16 bits.
MOST = 65535
# The code of a normal's coordinate 0, and the number of codes from there to the coordinate 1: -1, 0 and 1 are stored exactly.
ZERO, UNIT = 32768, 32767
# The digits of a scale, which times a power of 10 is the depth that one code stands for: round numbers, of which each is at
# most 2.5 times its predecessor, so that at most that factor of the resolution is lost.
ROUND = (1, 2, 5, 10)


@dataclass(frozen=True)
class Coding:
    """How the values of layers become codes.

    depth_scale: depth that one code stands for [scene units]; None chooses a round number that fits.
    legends: name of a layer of numbers -> number -> what it stands for, as JSON types.
    """

    depth_scale: float | None = None
    legends: Mapping[str, Mapping[int, Any]] = field(default_factory=dict)


def write(path: Path, arrays: Mapping[str, NDArray[np.float32]], coding: Coding, picture: Image) -> None:
    """Writes the files of the layers of a picture: a PNG file for each, and the JSON file that describes them.

    path: the picture's file.
    arrays: name -> (H, W, C), the layers.
    coding: how their values become codes.
    picture: the picture, whose texts and camera the files repeat.
    Errors: GlshadeError for a number that 16 bits cannot hold, or a file that cannot be written.
    """
    coded = {name: codes(path, name, array, coding) for name, array in arrays.items()}
    for name, (pixels, description) in coded.items():
        texts = {**picture.attributes, **picture.texts_of_camera, LAYER: json.dumps(description, separators=(",", ":"))}
        # "srgb" leaves out a statement about colours, which codes are not.
        write_file(png_path(path, name), PictureContents(pixels, encoding="srgb", premultiplied=False, attributes=texts))
    told = {name: {"file": png_path(path, name).name, **description} for name, (_, description) in coded.items()}
    text = json.dumps({"picture": path.name, "layers": told}, indent=1) + "\n"
    target = legend_path(path)
    try:
        with replacing(target) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise GlshadeError(f"{target}: cannot be written: {error.strerror or error}") from None


def codes(path: Path, name: str, array: NDArray[np.float32], coding: Coding) -> tuple[NDArray[Any], dict[str, Any]]:
    """Returns the codes (H, W, C) of a layer and its description, as JSON types.

    path: the picture's file, for messages.
    name: the layer, one of PNG_AOVS.
    array: its values (H, W, C).
    coding: the scale of depths, and the legends.
    Errors: GlshadeError for a layer or a number that a PNG file cannot hold.
    """
    if name == "depth":
        return _depth(path, array, coding.depth_scale)
    if name == "mask":
        return (array * 255).astype(np.uint8), {"encoding": "255 where there is a surface"}
    if name in ("normal", "view_normal"):
        found = np.any(array != 0, axis=2, keepdims=True)
        pixels = np.where(found, np.rint(array.astype(np.float64) * UNIT) + ZERO, 0)
        encoding = f"x, y, z = (code - {ZERO}) / {UNIT} in red, green, blue; 0, 0, 0 where there is no surface"
        return pixels.astype(np.uint16), {"encoding": encoding}
    if name in coding.legends:
        if array.size and array.max() > MOST:
            raise GlshadeError(f"{path}: the layer {name} has more than {MOST:,} numbers, which PNG cannot hold: use exr")
        legend = {str(number): told for number, told in coding.legends[name].items()}
        return array.astype(np.uint16), {"encoding": "number in the legend; 0 where there is no surface", "legend": legend}
    raise GlshadeError(f"{path}: the layer {name} cannot be stored as PNG: use exr")


def _depth(path: Path, array: NDArray[np.float32], scale: float | None) -> tuple[NDArray[Any], dict[str, Any]]:
    """Returns the codes of depths and their description. The arguments and errors are those of `codes`."""
    largest = float(array.max(initial=0.0))
    if not math.isfinite(largest):
        raise GlshadeError(f"{path}: holds a depth beyond float32, which PNG cannot hold: make the scene smaller")
    if scale is None:
        scale = round_scale(largest)
    elif largest > (MOST + 0.5) * scale:
        raise GlshadeError(
            f"{path}: holds the depth {largest:.6g}, but film.depth_scale = {scale:g} reaches to {MOST * scale:.6g} only: "
            f"{round_scale(largest):g} would do"
        )
    # A surface nearer than half a code must not look like none.
    pixels = np.where(array > 0, np.clip(np.rint(array.astype(np.float64) / scale), 1, MOST), 0)
    description = {"encoding": "depth = code * scale, along the view axis; 0 where there is no surface", "scale": scale}
    return pixels.astype(np.uint16), {**description, "unit": "scene units"}


def round_scale(largest: float) -> float:
    """Returns the least 1, 2 or 5 times a power of 10 by which MOST codes reach to the depth `largest`; 1 for depth 0."""
    least = largest / MOST
    if least <= 0:
        return 1.0
    exponent = math.floor(math.log10(least))
    # One more power above and below allow for the rounding of the logarithm.
    candidates = (float(f"{digit}e{power}") for power in (exponent - 1, exponent, exponent + 1) for digit in ROUND)
    return next(scale for scale in candidates if scale >= least)
