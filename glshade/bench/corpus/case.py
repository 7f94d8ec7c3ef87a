"""Case: one scene of the corpus with its baseline, from which the kinds make their test pictures."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.image import file as picture_file
from glshade.image.contents import PictureContents
from glshade.image.image import Image
from glshade.image.srgb import linear_to_srgb, srgb_to_linear
from glshade.scene.scene import Scene
from glshade.verification.mutations import Mutation

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[Any]
# The name of the text in a picture file that names the driver.
DRIVER = "glshade:renderer"


@dataclass(eq=False)
class Case:
    """A scene with its baseline.

    name: the scene's name.
    scene: the scene.
    path: the file of the baseline.
    renderer: the Renderer that drew the baseline.
    seed: the number from which random kinds follow.
    """

    name: str
    scene: Scene
    path: Path
    renderer: Renderer
    seed: int = 0

    @cached_property
    def baseline(self) -> Array:
        """The baseline's pixels as its file holds them: (H, W, 3 or 4), uint8 with straight alpha, or float32 and linear."""
        return picture_file.read_part(self.path, picture_file.parts(self.path)[0])

    @cached_property
    def attributes(self) -> dict[str, str]:
        """The texts in the baseline's file."""
        return picture_file.attributes(self.path)

    @property
    def floats(self) -> bool:
        """Whether the pictures hold floats."""
        return bool(self.baseline.dtype == np.float32)

    @cached_property
    def codes(self) -> Array:
        """The baseline as float64 codes: 8-bit codes, or what the codes of floats would be if they were not rounded."""
        return self.codes_of(self.baseline)

    @cached_property
    def linear(self) -> Array:
        """The picture of the scene as the renderer's floats (H, W, 3 or 4) [linear, premultiplied]."""
        return self.baseline if self.floats else self.drawn(self.scene, "float32")

    def random(self, kind: str) -> np.random.Generator:
        """Returns the random numbers of a kind; they follow from the seed, the scene's name and the kind's name."""
        return np.random.default_rng((self.seed, zlib.crc32(self.name.encode()), zlib.crc32(kind.encode())))

    def draw(self, scene: Scene | None = None, edits: Sequence[tuple[str, str]] = (), tile: int | None = None) -> Array:
        """Returns a picture like the baseline.

        scene: optional; the scene to draw in place of the case's own.
        edits: pairs of a regular expression and its replacement, which are applied to the text of the programs.
        tile: optional; the largest side that is drawn in one piece [pixels].
        Errors: those of `Renderer.render`.
        """
        self.renderer.rewrite = Mutation("corpus", "", tuple(edits)).rewrite if edits else None
        try:
            return self.drawn(scene or self.scene, "float32" if self.floats else "uint8", tile)
        finally:
            self.renderer.rewrite = None

    def drawn(self, scene: Scene, dtype: Any, tile: int | None = None) -> Array:
        """Returns a copy of the pixels of a scene's picture: the renderer uses its array again for the next picture."""
        return self.renderer.render(scene, dtype=dtype, tile=tile).pixels.copy()

    def edited(self, change: Callable[[Any], Any]) -> Array | None:
        """Returns the picture of the scene after a change of its document; None where the change returns None.

        change: takes the scene as a document of JSON types, and returns a changed document.
        """
        document = change(self.scene.model_dump(mode="json", exclude_defaults=True))
        return None if document is None else self.draw(Scene.model_validate(document))

    def codes_of(self, pixels: Array) -> Array:
        """Returns pixels of the baseline's type as codes, as in `codes`."""
        return codes_of(pixels) if self.floats else pixels.astype(np.float64)

    def of_codes(self, codes: Array) -> Array:
        """Returns codes (H, W, C), as in `codes`, as pixels of the baseline's type. Unchanged codes keep their bits."""
        if not self.floats:
            return np.clip(np.rint(codes), 0, 255).astype(np.uint8)
        same = codes == self.codes
        return np.where(same, self.baseline, linear_of(codes)).astype(np.float32)

    def of_linear(self, pixels: Array) -> Array:
        """Returns linear premultiplied floats (H, W, C) as pixels of the baseline's type, rounded to the nearest code."""
        if self.floats:
            return pixels.astype(np.float32)
        return Image(pixels.astype(np.float32)).encoded("srgb").pixels

    def write(self, path: Path, pixels: Array, attributes: Mapping[str, str]) -> None:
        """Writes pixels of the baseline's type to a file. Errors: GlshadeError."""
        write_pixels(path, pixels, attributes)


def write_pixels(path: Path, pixels: Array, attributes: Mapping[str, str]) -> None:
    """Writes pixels, as `Case.baseline` holds them, to a file. Errors: GlshadeError."""
    floats = pixels.dtype == np.float32
    contents = PictureContents(pixels, "linear" if floats else "srgb", premultiplied=floats, attributes=attributes)
    picture_file.write(path, contents)


def driver_attributes(renderer: Renderer) -> dict[str, str]:
    """Returns the text of a picture file that names the driver that drew it."""
    return {DRIVER: f"{renderer.context.renderer}; {renderer.context.version}"}


def codes_of(pixels: Array) -> Array:
    """Returns linear colours (H, W, 3) as float64 codes: sRGB-encoded up to 255, and linear beyond."""
    within = np.clip(pixels, 0, 1)
    codes: Array = 255 * (linear_to_srgb(within).astype(np.float64) + (pixels.astype(np.float64) - within))
    return codes


def linear_of(codes: Array) -> Array:
    """Returns the linear colours (H, W, 3) of float64 codes, the inverse of `codes_of`."""
    encoded = codes / 255
    within = np.clip(encoded, 0, 1)
    linear: Array = srgb_to_linear(within).astype(np.float64) + (encoded - within)
    return linear


def differing(reference: Array, test: Array, codes: int) -> int:
    """Returns the number of pixels that differ by more than this number of codes in a channel.

    A NaN or an infinity in the test counts as 10 pixels, because every comparison should find it.
    """
    broken = ~np.isfinite(test)
    if reference.dtype == np.float32:
        reference, test = codes_of(reference), codes_of(np.where(broken, 0, test))
    return int((np.abs(reference.astype(np.float64) - test) > codes).any(axis=2).sum()) + 10 * int(broken.sum())
