"""Storage: the formats in which the GPU stores texels, with as few bytes as keep them exact, the same for both renderers.

The texels of a picture of 8-bit codes are those codes, to the bit. The mipmaps of such a picture are averages of its linear
values, which are rounded once, to the nearest code of the format. docs/decisions/0010 gives the reasons for each format.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from glshade.image.srgb import linear_to_srgb, srgb_to_linear
from glshade.textures.mipmap import in_bands, smaller_levels

Pixels = NDArray[np.float32]
Codes = NDArray[np.uint8]
Array = NDArray[Any]

# The number of steps from 0 to 1 in the table that encodes linear numbers. The two darkest sRGB codes are 20 steps apart.
STEPS = 65535
# Half a step of rounding, before a number is cut off to an integer.
HALF = np.float32(0.5)
# A code of 8 bits takes this many steps of 16 bits: 65535 / 255.
WIDER = 257
# An 8-bit code k of a normal becomes the code 3 k + 129 of 10 bits: see Normal10.
SPREAD, FIRST = 3, 129
TEN_BITS = 1023


class Format(ABC):
    """A format of texels. `channels` is the number C of channels that are stored.

    codes: whether the texels are made from 8-bit codes, and not from floats.
    """

    codes: ClassVar[bool] = True

    def __init__(self, channels: int) -> None:
        self.channels = channels

    @property
    @abstractmethod
    def name(self) -> str:
        """OpenGL's name of the format."""

    @abstractmethod
    def stored(self, pixels: Array) -> Array:
        """Returns the texels of the largest level as they are uploaded, from the picture's own numbers (H, W, C)."""

    @abstractmethod
    def numbers(self, pixels: Array) -> Pixels:
        """Returns the numbers (H, W, C) that mipmaps average, from the picture's own numbers (H, W, C)."""

    @abstractmethod
    def rounded(self, numbers: Pixels) -> Array:
        """Returns the texels of a smaller level as they are uploaded, from averages (H, W, C) of `numbers`."""

    @abstractmethod
    def decoded(self, texels: Array) -> Pixels:
        """Returns the values (H, W, C) that shaders read, from the texels as they are uploaded."""


class Srgb8(Format):
    """8-bit colours, sRGB-encoded, which the driver decodes before it filters them. A fourth channel, alpha, is linear."""

    name = "SRGB8_ALPHA8"

    def stored(self, pixels: Array) -> Array:
        return pixels

    def numbers(self, pixels: Array) -> Pixels:
        result = _linear(pixels)
        if self.channels == 4:
            result[..., 3] = pixels[..., 3] * np.float32(1 / 255)
        return result

    def rounded(self, numbers: Pixels) -> Array:
        result = np.empty(numbers.shape, dtype=np.uint8)
        step = (numbers * np.float32(STEPS) + HALF).astype(np.uint16)
        np.take(_encoded(), step, out=result, mode="clip")
        if self.channels == 4:
            result[..., 3] = numbers[..., 3] * np.float32(255) + HALF
        return result

    def decoded(self, texels: Array) -> Pixels:
        return self.numbers(texels)


class Unorm16(Format):
    """8-bit codes from 0 to 1, stored in 16 bits. Some drivers filter 8-bit texels with 8 bits, and these with float32."""

    @property
    def name(self) -> str:
        return {1: "R16", 2: "RG16"}.get(self.channels, "RGBA16")

    def stored(self, pixels: Array) -> Array:
        return pixels * np.uint16(WIDER)

    def numbers(self, pixels: Array) -> Pixels:
        return pixels.astype(np.float32)

    def rounded(self, numbers: Pixels) -> Array:
        return (numbers * np.float32(WIDER) + HALF).astype(np.uint16)

    def decoded(self, texels: Array) -> Pixels:
        return texels.astype(np.float32) / np.float32(STEPS)


class Normal10(Format):
    """8-bit normals, stored in 10 bits a channel.

    From a texel t, shaders make the vector 2 t - 1, whose length does not matter. The code 3 k + 129 gives the vector of the
    8-bit code k times 765 / 1023, exactly: 2 (3 k + 129) / 1023 - 1 = (765 / 1023) (2 k / 255 - 1).
    """

    name = "RGB10_A2"

    def stored(self, pixels: Array) -> Array:
        return _packed(pixels * np.uint32(SPREAD) + np.uint32(FIRST))

    def numbers(self, pixels: Array) -> Pixels:
        return pixels.astype(np.float32)

    def rounded(self, numbers: Pixels) -> Array:
        return _packed((numbers * np.float32(SPREAD) + np.float32(FIRST) + HALF).astype(np.uint32))

    def decoded(self, texels: Array) -> Pixels:
        shifts = np.array([0, 10, 20], dtype=np.uint32)
        return ((texels >> shifts) & np.uint32(TEN_BITS)).astype(np.float32) / np.float32(TEN_BITS)


class Float(Format):
    """Floats of 32 bits, for everything that is not made of 8-bit codes."""

    codes = False

    @property
    def name(self) -> str:
        return {1: "R32F", 2: "RG32F"}.get(self.channels, "RGBA32F")

    def stored(self, pixels: Array) -> Array:
        return pixels

    def numbers(self, pixels: Array) -> Pixels:
        return pixels

    def rounded(self, numbers: Pixels) -> Array:
        return numbers

    def decoded(self, texels: Array) -> Pixels:
        return texels


@dataclass(frozen=True, eq=False)
class Stored:
    """A picture with its mipmaps, as it is uploaded. Row 0 is the bottom row.

    format: the format of the texels.
    swizzle: the stored channels, or the numbers 0 and 1, that shaders read as red, green, blue and alpha.
    levels: the texels (h, w, C) of each level, from the largest to the one of a single texel. RGB10_A2 has one integer a texel.
    """

    format: Format
    swizzle: str
    levels: tuple[Array, ...]

    @classmethod
    def of(cls, pixels: Array, form: Format, swizzle: str) -> Stored:
        """Returns a picture with its mipmaps.

        pixels: the picture (H, W, C), as 8-bit codes or as float32 numbers.
        form: the format in which it is stored.
        swizzle: as in `Stored`.
        """
        return cls(form, swizzle, (form.stored(pixels), *_smaller(pixels, form)))

    def decoded(self) -> Iterator[Pixels]:
        """Yields the values (h, w, 4) that shaders read of each level."""
        for level in self.levels:
            stored = self.format.decoded(level)
            result = np.empty((*stored.shape[:2], 4), dtype=np.float32)
            for channel, source in enumerate(self.swizzle):
                result[..., channel] = stored[..., "RGBA".index(source)] if source in "RGBA" else float(source)
            yield result


def _smaller(pixels: Array, form: Format) -> Iterator[Array]:
    for numbers in smaller_levels(pixels, form.numbers):
        yield in_bands(form.rounded, numbers)


def _packed(codes: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Returns texels (H, W, 1) of RGB10_A2 from codes (H, W, 3) of 10 bits; red has the lowest bits, and alpha is 1."""
    result: NDArray[Any] = codes[..., :1] | codes[..., 1:2] << 10 | codes[..., 2:3] << 20 | np.uint32(3 << 30)
    return result


def _linear(codes: Codes) -> Pixels:
    """Returns the linear values of sRGB codes of any shape."""
    if codes.size % 2:
        return linear_values()[codes]
    # Two codes at a time are looked up in half the time.
    pairs = np.take(_linear_pairs(), np.ascontiguousarray(codes).reshape(-1).view(np.uint16), mode="clip")
    return pairs.view(np.float32).reshape(codes.shape)


@cache
def _linear_pairs() -> NDArray[np.complex64]:
    """Returns two linear values (65536,), side by side in a complex number, for the 16 bits of two sRGB codes side by side."""
    codes = np.arange(1 << 16, dtype=np.uint16).view(np.uint8)
    return linear_values()[codes].view(np.complex64)


@cache
def linear_values() -> Pixels:
    """Returns the linear value (256,) of each sRGB code."""
    # OpenImageIO multiplies by the rounded reciprocal, too.
    return srgb_to_linear(np.arange(256, dtype=np.float32) * np.float32(1 / 255))


@cache
def _encoded() -> Codes:
    """Returns the nearest sRGB code of each of STEPS + 1 linear numbers from 0 to 1."""
    return np.rint(linear_to_srgb(np.linspace(0, 1, STEPS + 1)) * 255).astype(np.uint8)
