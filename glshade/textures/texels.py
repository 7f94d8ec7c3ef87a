"""Texels: what a picture file becomes before it is uploaded. Both renderers are given the same."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image import file as picture_file
from glshade.textures.texture import BumpMap, Encoding, Picture, Texture, WrapMode

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class Texels:
    """Which picture, and how it is read: equal ones are one texture.

    given: its wrap modes as the material has them. heights: what is read are heights, what is uploaded are normals.
    """

    path: Path
    given: tuple[WrapMode, WrapMode]
    encoding: Encoding = "linear"
    heights: bool = False

    @property
    def span(self) -> tuple[int, int]:
        """Along u and along v: how often the unit of texture coordinates goes into the texels.

        A mirrored hill falls where the hill itself rises, so the normals of heights lie side by side with their mirror image.
        """
        u, v = (2 if self.heights and mode == "mirror" else 1 for mode in self.given)
        return u, v

    @property
    def wrap(self) -> tuple[WrapMode, WrapMode]:
        """The modes by which the texels go on, u and v."""
        u, v = ("repeat" if times == 2 else mode for times, mode in zip(self.span, self.given, strict=True))
        return u, v

    def read(self) -> Pixels:
        """(H, W, 4) float32, straight alpha, row 0 at the bottom, where GL has it. Errors: AssetError."""
        pixels = np.ascontiguousarray(picture_file.read(self.path, self.encoding)[0][::-1])
        return normals(pixels[..., 0], self.given) if self.heights else pixels


def texels(material: Any, name: str) -> Texels:
    """How the picture that is the material's `name` is read."""
    picture: Picture = getattr(material, name)
    if not isinstance(picture, Texture):
        return Texels(picture.texture, picture.wrap, heights=isinstance(picture, BumpMap))
    # Numbers are no colours: nobody encodes them.
    linear = picture.encoding == "auto" and not type(material).is_colour(name)
    return Texels(picture.texture, picture.wrap, "linear" if linear else picture.encoding)


def normals(heights: Pixels, wrap: tuple[WrapMode, WrapMode]) -> Pixels:
    """(H, W, 4): tangent-space normals (1 + n) / 2 of heights (H, W) that count the picture's width as 1. Row 0 is the bottom.

    n = (-dz/dx, -dz/dy, 1), not unit: its x and y are linear in the heights, so that the mean of normals, by which textures
    are made smaller, is the normal of the mean heights. Twice as wide or high where mirrored (`Texels.span`).
    """
    z = heights.astype(np.float64)
    for axis, mode in ((1, wrap[0]), (0, wrap[1])):
        if mode == "mirror":
            z = np.concatenate([z, np.flip(z, axis)], axis)
    slopes = []
    for axis, mode in ((1, wrap[0]), (0, wrap[1])):
        # Two texels lie between the ends of a difference.
        slope = (np.roll(z, -1, axis) - np.roll(z, 1, axis)) * heights.shape[1] / 2
        if mode == "clamp":
            # The border goes on as it is for ever, and so would its slope.
            np.moveaxis(slope, axis, 0)[[0, -1]] = 0
        slopes.append(slope)
    one = np.ones_like(z)
    return np.stack([(1 - slopes[0]) / 2, (1 - slopes[1]) / 2, one, one], axis=-1).astype(np.float32)
