"""Texels: the arrays that are read from pictures and uploaded as textures, the same for both renderers."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image import file as picture_file
from glshade.image.file import Encoding
from glshade.textures.pixel_array import PixelArray
from glshade.textures.texture import BumpMap, Filter, Picture, Placement, Texture, WrapMode

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class Texels:
    """A picture and the way in which it is read. Equal Texels share one texture on the GPU.

    source: the picture file, or the picture in memory.
    given: the wrap modes that the material asks for, along u and along v.
    encoding: the encoding of the picture's colours.
    heights: whether the picture holds heights, from which normals are made for the upload.
    filter: how texels are filtered where the picture is magnified.
    """

    source: Path | PixelArray
    given: tuple[WrapMode, WrapMode]
    encoding: Encoding = "linear"
    heights: bool = False
    filter: Filter = "smooth"

    @property
    def span(self) -> tuple[int, int]:
        """How many units of texture coordinates the texels span, along u and along v: 1 or 2.

        The slopes of a mirrored height map have the opposite sign. So its normals are stored beside those of its mirror image,
        and the texels span two units.
        """
        u, v = (2 if self.heights and mode == "mirror" else 1 for mode in self.given)
        return u, v

    @property
    def wrap(self) -> tuple[WrapMode, WrapMode]:
        """The wrap modes of the uploaded texels, along u and along v. Texels that include a mirror image only repeat."""
        u, v = ("repeat" if times == 2 else mode for times, mode in zip(self.span, self.given, strict=True))
        return u, v

    @property
    def key(self) -> Hashable:
        """The key of these texels in a cache. It differs after a change of the file, and keeps no picture in memory alive.

        Errors: OSError for a file that does not exist.
        """
        source = self.source.digest if isinstance(self.source, PixelArray) else (self.source, self.source.stat().st_mtime_ns)
        return source, self.given, self.encoding, self.heights, self.filter

    def read(self) -> Pixels:
        """Returns the texels (H, W, 4) float32, linear, with straight alpha. Row 0 is the bottom row, as OpenGL expects.

        Errors: AssetError.
        """
        if isinstance(self.source, PixelArray):
            found = self.source.read(self.encoding)
        else:
            found = picture_file.read(self.source, self.encoding)[0]
        pixels = np.ascontiguousarray(found[::-1])
        return normals(pixels[..., 0], self.given) if self.heights else pixels


def texels_of(material: Any, name: str) -> Texels:
    """Returns the Texels of the picture that a material has under the key `name`."""
    picture: Picture = getattr(material, name)
    if not isinstance(picture, Texture):
        return Texels(picture.texture, picture.wrap, heights=isinstance(picture, BumpMap), filter=picture.filter)
    # Parameters that are numbers are stored as they are: only colours are sRGB-encoded.
    linear = picture.encoding == "auto" and not type(material).is_colour(name)
    return Texels(picture.texture, picture.wrap, "linear" if linear else picture.encoding, filter=picture.filter)


def placement_of(material: Any, name: str) -> Placement:
    """Returns the placement of the picture that a material has under the key `name`."""
    placement: Placement = getattr(material, name).placement
    return placement


def normals(heights: Pixels, wrap: tuple[WrapMode, WrapMode]) -> Pixels:
    """Returns the tangent-space normals of a height map, as texels (1 + n) / 2 (H, W, 4). Row 0 is the bottom row.

    For the height z, n = (-dz/dx, -dz/dy, 1), which is not made unit. Its x and y are linear in the heights, so that a mipmap's
    mean of normals is the normal of the mean heights. The result is twice as wide or high where the heights are mirrored
    (`Texels.span`).
    heights: the heights (H, W) [widths of the picture].
    wrap: the wrap modes along u and along v.
    """
    z = heights.astype(np.float64)
    for axis, mode in ((1, wrap[0]), (0, wrap[1])):
        if mode == "mirror":
            z = np.concatenate([z, np.flip(z, axis)], axis)
    slopes = []
    for axis, mode in ((1, wrap[0]), (0, wrap[1])):
        # The central difference spans two texels.
        slope = (np.roll(z, -1, axis) - np.roll(z, 1, axis)) * heights.shape[1] / 2
        if mode == "clamp":
            # Beyond the border a clamped height stays constant, so the slope at the border is 0.
            np.moveaxis(slope, axis, 0)[[0, -1]] = 0
        slopes.append(slope)
    ones = np.ones_like(z)
    return np.stack([(1 - slopes[0]) / 2, (1 - slopes[1]) / 2, ones, ones], axis=-1).astype(np.float32)
