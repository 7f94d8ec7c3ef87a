"""Page pictures: the pictures of one case in the form in which the page shows them."""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import AssetError
from glshade.golden.judge import pairs
from glshade.golden.pair import Pair
from glshade.golden.results import Case, picture_path
from glshade.image.srgb import linear_to_srgb
from glshade.page.ramp import colours
from glshade.page.small import as_base64, smaller

Array = NDArray[Any]

# The largest width and height of a thumbnail [pixels]: twice its size in the list, for screens with two pixels a point.
THUMBNAIL = 144
# The largest pictures of floats and of 8-bit codes that the page gets; of larger ones it gets every second or third pixel, so
# that a browser has the memory for both pictures and their difference [pixels].
MOST_FLOATS, MOST_CODES = 1 << 22, 1 << 24
# The grey behind the transparent parts of a thumbnail, as an 8-bit code.
BEHIND = 128
# The least difference with a colour of its own, of 8-bit pictures and of floats; the map of the page has the same [linear].
FAINTEST_CODE, FAINTEST = 1 / 255, 1e-5
# The ramp's place of the least difference, well apart from the first colour, which stands for equal pixels.
SEEN = 0.25
# The bytes 25 and 28 of a PNG file, for colour types that hold codes and no palette, and for pixels in the order of the rows.
PLAIN_TYPES, NOT_INTERLACED = (0, 2, 4, 6), 0


@dataclass
class CasePictures:
    """The pictures of one case. A role is expected, actual or difference.

    thumbnails: role -> a small picture, as an address that holds its bytes.
    exact: role, or classes -> the picture with all values, as `_exact` returns it; empty where the pictures are equal or cannot
        be read.
    layer: the name of the layer that the pictures show; empty for the picture itself.
    reduced: the factor by which exact pictures are reduced; 1 if they have all pixels.
    """

    thumbnails: dict[str, str] = field(default_factory=dict)
    exact: dict[str, Any] = field(default_factory=dict)
    layer: str = ""
    reduced: int = 1


def pictures_of(folder: Path, case: Case) -> CasePictures:
    """Returns the pictures of a case; none for files that are missing or cannot be read, which the case's reason says.

    folder: the folder of results. Errors: GlshadeError where a path leads out of it.
    """
    found = {role: picture_path(folder, case, role) for role in ("expected", "actual")}
    paths = {role: path for role, path in found.items() if path is not None}
    # A browser shows a PNG file by itself, and equal pictures need no values.
    if case.outcome == "same" and not _differs(case) and all(path.suffix.lower() == ".png" for path in paths.values()):
        return CasePictures()
    result = _of_paths(paths, case)
    classes = picture_path(folder, case, "classes")
    if classes is not None and result.exact and (pair := _layer(classes, classes, None)) is not None:
        result.exact["classes"] = _exact(pair.test, pair.channels, classes, whole=True)
    return result


def _of_paths(paths: Mapping[str, Path], case: Case) -> CasePictures:
    """Returns the expected and the actual picture of a case, and their difference where they have the same layer."""
    name = _worst_layer(case)
    if len(paths) == 2 and case.outcome != "sizes":
        pair = _layer(paths["expected"], paths["actual"], name)
        if pair is not None:
            return _of_pair(pair, paths)
    return _of_singles({role: pair for role, path in paths.items() if (pair := _layer(path, path, name)) is not None}, paths)


def _differs(case: Case) -> bool:
    """Returns whether a pixel of a case differs, as far as is known."""
    return any((layer.get("metrics") or {"worst": 1})["worst"] > 0 for layer in case.layers)


def _worst_layer(case: Case) -> str | None:
    """Returns the name of the layer with the worst outcome; None for the first layer of the file."""
    order = ["same", "warn", "fail"]
    layers = case.layers
    worst = max(layers, key=lambda layer: order.index(layer["outcome"]), default=None)
    return worst["name"] if worst is not None and worst["outcome"] != "same" else None


def _layer(expected: Path, actual: Path, name: str | None) -> Pair | None:
    """Returns a layer of two files; None where they have no such layer in common, or cannot be read."""
    try:
        return next((pair for pair in pairs(expected, actual) if name in (None, pair.name)), None)
    # ValueError: the files have different layers.
    except (AssetError, OSError, ValueError, MemoryError):
        return None


def _of_pair(pair: Pair, paths: Mapping[str, Path]) -> CasePictures:
    """Returns the pictures of a layer that both files have."""
    both = {"expected": pair.reference, "actual": pair.test}
    result = _of_layers({role: (pixels, pair.channels) for role, pixels in both.items()}, paths, pair.name)
    if pair.reference.shape == pair.test.shape:
        place = smaller(_places(pair), np.maximum, THUMBNAIL)
        result.thumbnails["difference"] = "data:image/png;base64," + as_base64(colours(place), "png")
    return result


def _of_singles(found: Mapping[str, Pair], paths: Mapping[str, Path]) -> CasePictures:
    """Returns the pictures of files that have no layer in common, or of one file alone."""
    name = next((pair.name for pair in found.values()), "")
    return _of_layers({role: (pair.test, pair.channels) for role, pair in found.items()}, paths, name)


def _of_layers(layers: Mapping[str, tuple[Array, tuple[str, ...]]], paths: Mapping[str, Path], name: str) -> CasePictures:
    """Returns the pictures of one layer of each file."""
    result = CasePictures(layer=name)
    for role, (pixels, channels) in layers.items():
        most = MOST_CODES if pixels.dtype == np.uint8 else MOST_FLOATS
        step = math.ceil(math.sqrt(pixels.shape[0] * pixels.shape[1] / most))
        result.reduced = max(result.reduced, step)
        whole = step == 1 and len(channels) <= 4
        result.exact[role] = _exact(pixels[::step, ::step, :4], channels[:4], paths[role], whole=whole)
        result.thumbnails[role] = "data:image/jpeg;base64," + as_base64(_thumbnail(pixels, channels), "jpg")
    return result


def _exact(pixels: Array, channels: tuple[str, ...], path: Path, whole: bool) -> dict[str, Any]:
    """Returns a picture with all its values, for JSON: a PNG file for 8-bit codes, and compressed float32 numbers for others.

    whole: whether these are all pixels and channels of the layer.
    """
    if pixels.dtype == np.uint8:
        data = path.read_bytes() if whole and path.suffix.lower() == ".png" else b""
        text = base64.b64encode(data).decode("ascii") if _is_plain(data) else as_base64(pixels, "png")
        return {"kind": "png", "channels": channels, "data": text}
    height, width = pixels.shape[:2]
    # Bytes of equal weight lie together, which halves the compressed size. Level 1 is five times as fast as the default.
    planes = np.ascontiguousarray(pixels, dtype="<f4").view(np.uint8).reshape(-1, 4).T
    data = zlib.compress(planes.tobytes(), 1)
    return {
        "kind": "floats",
        "channels": channels,
        "size": [width, height],
        "data": base64.b64encode(data).decode("ascii"),
    }


def _is_plain(data: bytes) -> bool:
    """Returns whether the page's script can decode a PNG file: 8 bits a channel, without a palette and not interlaced."""
    return len(data) > 28 and data[24] == 8 and data[25] in PLAIN_TYPES and data[28] == NOT_INTERLACED and b"tRNS" not in data


def _thumbnail(pixels: Array, channels: tuple[str, ...]) -> Array:
    """Returns a small picture (H, W, 3) uint8 of a layer (H, W, C), in front of grey where it is transparent."""
    floats = pixels.dtype != np.uint8
    small: Array = smaller(pixels, np.add, THUMBNAIL).astype(np.float32)
    small = np.nan_to_num(small, nan=0.0, posinf=0.0, neginf=0.0) if floats else small / 255
    count = small.shape[2]
    alpha = small[..., -1:] if channels[-1] == "A" else np.ones_like(small[..., :1])
    colour: Array = small[..., :3] if count >= 3 else np.repeat(small[..., :1], 3, axis=2)
    if floats and channels[:1] == ("X",):
        # The components of a direction lie between -1 and 1.
        colour = colour / 2 + 0.5
    elif floats:
        # Premultiplied colours become straight ones; then they are encoded.
        colour = linear_to_srgb(np.divide(colour, alpha, out=colour.copy(), where=alpha > 0))
    codes: Array = np.rint(np.clip(colour * alpha + BEHIND / 255 * (1 - alpha), 0, 1) * 255).astype(np.uint8)
    return codes


def _places(pair: Pair) -> Array:
    """Returns the places of the differences on the ramp, (H, W) from 0 to 1, on a logarithmic scale up to a difference of 1."""
    codes = pair.reference.dtype == np.uint8 and pair.test.dtype == np.uint8
    least = FAINTEST_CODE if codes else FAINTEST
    errors = np.nan_to_num(pair.errors, nan=1.0, posinf=1.0)
    places: Array = np.zeros(pair.changed.shape, dtype=np.float32)
    share = np.clip(1 - np.log(np.clip(errors, least, 1.0)) / np.log(least), 0, 1)
    places[pair.changed] = np.where(errors > 0, SEEN + (1 - SEEN) * share, 0)
    return places
