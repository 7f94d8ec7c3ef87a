"""Texels: the arrays that are read from pictures and uploaded as textures, the same for both renderers."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.image import file as picture_file
from glshade.image.contents import PictureContents
from glshade.image.file import Encoding
from glshade.textures.pixel_array import PixelArray
from glshade.textures.storage import Float, Normal10, Srgb8, Stored, Unorm16
from glshade.textures.texture import (
    CHANNELS,
    BumpMap,
    DirectionMap,
    Filter,
    OcclusionMap,
    Picture,
    Placement,
    Texture,
    WrapMode,
)

Pixels = NDArray[np.float32]
# What shaders read of a picture: its channels, a normal, a direction, or the slopes of heights.
Use = Literal["channels", "normal", "direction", "slopes"]
# The number of colour channels of a picture -> the swizzle of its texels, if the picture has no alpha.
COLOURS = {1: "RRR1", 3: "RGB1"}


@dataclass(frozen=True)
class Texels:
    """A picture and the way in which it is read. Equal Texels share one texture on the GPU.

    source: the picture file, or the picture in memory.
    given: the wrap modes that the material asks for, along u and along v.
    encoding: the encoding of the picture's colours.
    use: what shaders read of the picture. From heights, normals are made for the upload.
    channels: the channels that shaders read, some of "rgba" in this order. The others are undefined.
    filter: how texels are filtered where the picture is magnified.
    """

    source: Path | PixelArray
    given: tuple[WrapMode, WrapMode]
    encoding: Encoding = "linear"
    use: Use = "channels"
    channels: str = CHANNELS
    filter: Filter = "smooth"

    @property
    def span(self) -> tuple[int, int]:
        """How many units of texture coordinates the texels span, along u and along v: 1 or 2.

        The slopes of a mirrored height map have the opposite sign. So its normals are stored beside those of its mirror image,
        and the texels span two units.
        """
        u, v = (2 if self.use == "slopes" and mode == "mirror" else 1 for mode in self.given)
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
        return source, self.given, self.encoding, self.use, self.channels, self.filter

    def read(self) -> Stored:
        """Returns the picture with its mipmaps, in the form in which it is uploaded. Errors: AssetError."""
        if isinstance(self.source, PixelArray):
            contents = self.source.contents
        else:
            contents = picture_file.read_contents(self.source)
        srgb = self.encoding == "srgb" or (self.encoding == "auto" and contents.encoding == "srgb")
        # Slopes are not codes, and neither are colours that are divided by the alpha that they were multiplied by.
        divided = contents.premultiplied and contents.has_alpha
        if contents.pixels.dtype != np.uint8 or divided or self.use == "slopes":
            return self._of_floats(contents)
        return self._of_codes(contents, srgb)

    def _of_floats(self, contents: PictureContents) -> Stored:
        """Returns a picture that is stored as floats."""
        pixels = picture_file.for_texture(contents, self.encoding)[0][::-1]
        if self.use == "slopes":
            return Stored.of(normals(pixels[..., 0], self.given), Float(2), "RG11")
        if len(self.channels) <= 2:
            return Stored.of(_chosen(pixels, True, self.channels), Float(len(self.channels)), _swizzle(self.channels))
        return Stored.of(np.ascontiguousarray(pixels), Float(4), "RGBA")

    def _of_codes(self, contents: PictureContents, srgb: bool) -> Stored:
        """Returns a picture of 8-bit codes. srgb: whether its colours are sRGB-encoded."""
        codes, has_alpha = contents.pixels[::-1], contents.has_alpha
        if self.use == "normal":
            return Stored.of(_three(codes, has_alpha), Normal10(3), "RGB1")
        if not srgb and len(self.channels) <= 2:
            return Stored.of(_chosen(codes, has_alpha, self.channels), Unorm16(len(self.channels)), _swizzle(self.channels))
        return _of_colours(codes, has_alpha, srgb)


def texels_of(material: Any, name: str) -> Texels:
    """Returns the Texels of the picture that a material has under the key `name`.

    Parameters that read several channels of one picture have equal Texels, so that they share one texture.
    """
    result = _alone(material, name)
    if result.channels == CHANNELS or result.use != "channels":
        return result
    read = set(result.channels)
    for key in type(material).model_fields:
        if key != name and isinstance(getattr(material, key), Picture):
            other = _alone(material, key)
            if replace(other, channels=result.channels) == result:
                read |= set(other.channels)
    return replace(result, channels="".join(sorted(read, key=CHANNELS.index)))


def _alone(material: Any, name: str) -> Texels:
    """Returns the Texels of a material's picture if no other parameter reads it."""
    picture: Picture = getattr(material, name)
    if not isinstance(picture, Texture):
        use, channels = _use(picture)
        return Texels(picture.texture, picture.wrap, "linear", use, channels, picture.filter)
    if type(material).is_colour(name):
        return Texels(picture.texture, picture.wrap, picture.encoding, filter=picture.filter)
    # Parameters that are numbers are stored as they are: only colours are sRGB-encoded.
    encoding: Encoding = "linear" if picture.encoding == "auto" else picture.encoding
    return Texels(picture.texture, picture.wrap, encoding, "channels", picture.channel or "r", picture.filter)


def _use(picture: Picture) -> tuple[Use, str]:
    """Returns what shaders read of a picture that holds no parameter, and the channels."""
    if isinstance(picture, OcclusionMap):
        return "channels", picture.channel
    if isinstance(picture, BumpMap):
        return "slopes", "rgb"
    return ("direction", "rg") if isinstance(picture, DirectionMap) else ("normal", "rgb")


def _of_colours(codes: NDArray[np.uint8], has_alpha: bool, srgb: bool) -> Stored:
    """Returns a picture of 8-bit colours (H, W, C), of which shaders read all channels. Row 0 is the bottom row."""
    if has_alpha:
        codes = np.concatenate([_three(codes, True), codes[..., -1:]], axis=2)
    elif codes.shape[2] not in COLOURS:
        codes = codes[..., :3]
    codes = np.ascontiguousarray(codes)
    count = codes.shape[2]
    return Stored.of(codes, Srgb8(count) if srgb else Unorm16(count), COLOURS.get(count, "RGBA"))


def _three(pixels: NDArray[Any], has_alpha: bool) -> NDArray[Any]:
    """Returns the three colour channels (H, W, 3) of a picture (H, W, C). Grey pictures have three equal ones."""
    colours = pixels[..., : pixels.shape[2] - has_alpha]
    return colours[..., :3] if colours.shape[2] >= 3 else np.repeat(colours[..., :1], 3, axis=2)


def _chosen(pixels: NDArray[Any], has_alpha: bool, channels: str) -> NDArray[Any]:
    """Returns some channels of a picture (H, W, C). Alpha is 1 where the picture has none."""
    opaque = 255 if pixels.dtype == np.uint8 else 1
    colours = _three(pixels, has_alpha)
    alpha = pixels[..., -1] if has_alpha else np.full_like(pixels[..., 0], opaque)
    return np.stack([alpha if name == "a" else colours[..., CHANNELS.index(name)] for name in channels], axis=2)


def _swizzle(channels: str) -> str:
    """Returns the swizzle that lets shaders find some channels, which are stored as red, green and so on, in their places."""
    return "".join("RGBA"[channels.index(name)] if name in channels else "0" for name in CHANNELS)


def placement_of(material: Any, name: str) -> Placement:
    """Returns the placement of the picture that a material has under the key `name`."""
    placement: Placement = getattr(material, name).placement
    return placement


def normals(heights: Pixels, wrap: tuple[WrapMode, WrapMode]) -> Pixels:
    """Returns the tangent-space normals of a height map, as texels (1 + n) / 2 (H, W, 2). Row 0 is the bottom row.

    For the height z, n = (-dz/dx, -dz/dy, 1), which is not made unit, and whose z is left out. Its x and y are linear in the
    heights, so that a mipmap's mean of normals is the normal of the mean heights. The result is twice as wide or high where the
    heights are mirrored
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
    return np.stack([(1 - slope) / 2 for slope in slopes], axis=-1).astype(np.float32)
