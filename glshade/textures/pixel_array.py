"""Pixel arrays: pictures that a program holds in memory, in place of picture files."""

from __future__ import annotations

import hashlib
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from glshade.image.contents import PictureContents


class PixelArray:
    """The pixels of a picture in memory. While one is in use, `of` returns the same object for equal pixels.

    pixels: (H, W, C) uint8 or float32 with C from 1 to 4, row 0 at the top, with straight alpha; it is read-only.
    digest: the SHA-256 of their shape, type and bytes, 64 hex digits.
    """

    def __init__(self, pixels: NDArray[Any], digest: str) -> None:
        self.pixels, self.digest = pixels, digest

    @classmethod
    def of(cls, values: NDArray[Any]) -> PixelArray:
        """Returns the picture with these pixels. They are copied, so that the picture stays the same if the array changes.

        values: (H, W) or (H, W, C): uint8, which counts as sRGB-encoded like a file of integers, or finite floats, which count
            as linear. One channel is grey, two are grey and alpha, three are colours, four are colours and alpha.
        Errors: ValueError with the reason.
        """
        if values.dtype != np.uint8 and not np.issubdtype(values.dtype, np.floating):
            raise ValueError(f"an array of pixels must have the type uint8 or a type of floats, not {values.dtype}")
        if values.ndim not in (2, 3) or not values.size or (values.ndim == 3 and values.shape[2] > 4):
            raise ValueError(f"an array of pixels must have the shape (H, W) or (H, W, 1 to 4), not {values.shape}")
        # A file of 16-bit floats or of doubles is read as float32, too. A number beyond float32 becomes infinite here.
        with np.errstate(over="ignore"):
            pixels = np.array(values[::-1], dtype=np.uint8 if values.dtype == np.uint8 else np.float32, order="C")
        if pixels.dtype != np.uint8 and not np.isfinite(pixels).all():
            raise ValueError("an array of pixels must hold finite numbers of float32's range")
        pixels = pixels.reshape(*pixels.shape[:2], -1)
        pixels.flags.writeable = False
        digest = hashlib.sha256(f"{pixels.shape} {pixels.dtype}".encode())
        digest.update(pixels.data)
        # Textures are uploaded from the bottom row on, in which order the rows lie in memory.
        return _in_use.setdefault(digest.hexdigest(), cls(pixels[::-1], digest.hexdigest()))

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy and an unpickled picture are the object that is in use already, if the process has one.
        return PixelArray.of, (self.pixels,)

    def __repr__(self) -> str:
        return f"<PixelArray {'x'.join(map(str, self.pixels.shape))} {self.pixels.dtype} {self.digest[:12]}>"

    @property
    def contents(self) -> PictureContents:
        """The picture as if it had been read from a file: uint8 counts as sRGB-encoded, floats as linear."""
        return PictureContents(self.pixels, "srgb" if self.pixels.dtype == np.uint8 else "linear", False)


# Digest -> the picture, for the pictures that are in use.
_in_use: WeakValueDictionary[str, PixelArray] = WeakValueDictionary()
