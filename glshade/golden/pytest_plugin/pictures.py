"""Pictures: turns what a test hands over (images, layers, arrays, files, scenes) into a picture file."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.image.contents import PictureContents
from glshade.image.file import format_of, parts, read_part
from glshade.image.image import Image
from glshade.image.layers import Layers
from glshade.mesh.file import SUFFIXES as MESHES
from glshade.scene.file import TEXT_SUFFIXES, load
from glshade.scene.override import split
from glshade.scene.scene import Scene

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

# The formats of baselines: both lossless, one for 8-bit codes and one for floats and layers.
SUFFIXES = (".png", ".exr")
KINDS = "an image, layers, an array, a picture of Pillow, a scene, or the path of a picture (PNG, EXR) or of a scene file"
# Pillow's modes whose values an array holds as they are; those that become one of them without loss; the channels of an array.
_AS_THEY_ARE, _CONVERTED = {"L", "LA", "RGB", "RGBA", "F"}, {"1": "L", "P": "RGBA", "PA": "RGBA", "RGBX": "RGB"}
_CHANNELS = {1: ("Y",), 2: ("Y", "A"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}


@dataclass(frozen=True)
class Picture:
    """A picture that can be written to a file.

    suffix: the suffix of the format that holds it without loss, ".png" or ".exr".
    write: a function that writes the file, whose suffix is one of SUFFIXES; a scene is drawn anew at each call.
        Errors: GlshadeError, OSError.
    scene: the scene that `write` draws; None for a picture that the test has made.
    scene_file: the file of that scene; None where the test has made the scene.
    overrides: values that replaced those of that file, as `--set` takes them.
    """

    suffix: str
    write: Callable[[Path], None]
    scene: Scene | None = None
    scene_file: Path | None = None
    overrides: tuple[str, ...] = ()


def take(given: object, renderer: Callable[[], Renderer], overrides: tuple[str, ...] = ()) -> Picture:
    """Returns what a test has handed over as a Picture.

    renderer: a function that returns the Renderer for scenes; it is called when a scene is drawn.
    overrides: values that replace those of a scene file, as `--set` takes them.
    Errors: GlshadeError where it is no picture, or one that neither PNG nor EXR holds; SceneError.
    """
    path = Path(given) if isinstance(given, str | os.PathLike) else None
    if path is not None and path.suffix.lower() in {*TEXT_SUFFIXES, *MESHES}:
        drawn = _from_scene(load(path, [split(text) for text in overrides]), renderer)
        return replace(drawn, scene_file=path, overrides=overrides)
    if overrides:
        raise GlshadeError(f"overrides= is for scene files, and {path or _kind(given)} is none")
    if path is not None:
        return _from_file(path)
    if isinstance(given, Scene):
        return _from_scene(given, renderer)
    if isinstance(given, Layers):
        return Picture(".exr", lambda path: _write_layers(given, path))
    if isinstance(given, Image):
        return _from_image(given)
    if hasattr(given, "__array__") or hasattr(given, "__array_interface__"):
        return from_array(_values(given))
    raise GlshadeError(f"{_kind(given)} is no picture; hand over {KINDS}")


def _from_image(image: Image) -> Picture:
    """Returns the picture of an image. Errors: GlshadeError where its pixels are not as Image says."""
    pixels = image.pixels
    if pixels.dtype not in (np.uint8, np.float32) or pixels.ndim != 3 or 0 in pixels.shape or pixels.shape[2] not in (3, 4):
        raise GlshadeError(
            f"the pixels of an Image must be uint8 or float32 of shape (H, W, 3 or 4); they are {pixels.dtype} of shape "
            f"{pixels.shape}"
        )
    return Picture(_suffix(pixels), lambda path: _write_image(image, path))


def _from_file(path: Path) -> Picture:
    """Returns the picture in a file. Errors: GlshadeError."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise GlshadeError(f"{path}: is neither a picture in PNG or EXR nor a scene file")
    if not path.is_file():
        raise GlshadeError(f"{path}: there is no such file")
    # A picture that cannot be read must not become a baseline.
    for part in parts(path):
        read_part(path, part)

    def write(target: Path) -> None:
        if target.suffix != suffix:
            raise GlshadeError(f"{path}: cannot be compared with a {target.suffix} baseline; write the picture as such a file")
        shutil.copyfile(path, target)

    return Picture(suffix, write)


def _from_scene(scene: Scene, renderer: Callable[[], Renderer]) -> Picture:
    """Returns the picture of a scene: in 8-bit codes, or in floats where the film asks for layers or the file is an EXR."""
    layered = bool(scene.film.aovs)

    def write(target: Path) -> None:
        drawer = renderer()
        if target.suffix == ".png":
            _write_image(drawer.render(scene), target)
        elif layered:
            _write_layers(drawer.layers(scene), target)
        else:
            _write_image(drawer.render(scene, dtype="float32"), target)

    return Picture(".exr" if layered else ".png", write, scene)


def _values(given: Any) -> NDArray[Any]:
    """Returns the values of an object that is like an array. Errors: GlshadeError for a mode of Pillow without equivalent."""
    pillow = sys.modules.get("PIL.Image")
    if pillow is not None and isinstance(given, pillow.Image):
        if given.mode not in {*_AS_THEY_ARE, *_CONVERTED}:
            raise GlshadeError(f"a picture of Pillow in the mode {given.mode} is not compared; convert it to RGB or RGBA")
        given = given.convert(_CONVERTED[given.mode]) if given.mode in _CONVERTED else given
    return np.asarray(given)


def from_array(values: NDArray[Any]) -> Picture:
    """Returns the picture in an array: uint8 codes, sRGB-encoded with straight alpha, or floats, linear and premultiplied.

    Errors: GlshadeError for another shape or another type of number.
    """
    pixels = values[..., None] if values.ndim == 2 else values
    if pixels.ndim != 3 or 0 in pixels.shape or pixels.shape[2] not in _CHANNELS:
        raise GlshadeError(f"an array of shape {values.shape} is no picture; the shape must be (H, W) or (H, W, 1 to 4)")
    if pixels.dtype != np.uint8 and pixels.dtype.kind != "f":
        raise GlshadeError(f"an array of {pixels.dtype} is not compared; convert it to uint8 codes, or to floats from 0 to 1")
    codes = pixels.dtype == np.uint8
    # Numbers that are too large for float32 become infinite, which fails.
    with np.errstate(over="ignore"):
        stored = pixels if codes else pixels.astype(np.float32)
    contents = PictureContents(
        stored,
        encoding="srgb" if codes else "linear",
        premultiplied=not codes,
        channels=_CHANNELS[pixels.shape[2]],
    )

    def write(path: Path) -> None:
        if path.suffix == _suffix(pixels):
            _write(path, contents)
        elif pixels.shape[2] > 2:
            _write_image(Image(contents.pixels, contents.encoding), path)
        else:
            raise GlshadeError(f"a grey array of {pixels.dtype} needs a {_suffix(pixels)} baseline")

    return Picture(_suffix(pixels), write)


def _write_image(image: Image, path: Path) -> None:
    """Writes an image, encoded as sRGB in a PNG and linear in an EXR. Errors: GlshadeError, OSError."""
    floats = format_of(path).floats
    if not floats and not np.isfinite(image.pixels).all():
        raise GlshadeError(
            "a value of the picture is infinite or NaN, which a PNG cannot hold; use an .exr baseline to see where"
        )
    stored = image.linear() if floats else image.encoded()
    texts, corner, whole = stored.attributes, stored.corner, stored.whole
    _write(path, PictureContents(stored.pixels, stored.encoding, floats, attributes=texts, corner=corner, whole=whole))


def _write_layers(layers: Layers, path: Path) -> None:
    """Writes a picture and its layers. Errors: GlshadeError, also for a format that holds no layers."""
    if not format_of(path).layers:
        raise GlshadeError(f"layers need an .exr baseline, and this one is a {path.suffix}; compare `.image` alone for that")
    layers.save(path)


def _write(path: Path, contents: PictureContents) -> None:
    """Writes a temporary file. Unlike `glshade.image.file.write`, it does not wait for the disk. Errors: OSError."""
    format_of(path).write(path, contents)


def _suffix(pixels: NDArray[Any]) -> str:
    """Returns the suffix of the format that holds pixels without loss."""
    return ".png" if pixels.dtype == np.uint8 else ".exr"


def _kind(given: object) -> str:
    """Returns a word for an object, for messages."""
    return "None" if given is None else f"an object of the type {type(given).__qualname__}"
