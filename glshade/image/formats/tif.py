"""TIFF: 8 bits a channel, compressed without loss."""

from typing import ClassVar

from glshade.image.formats import FIXED_TIME, PictureFormat, Settings


class Tif(PictureFormat):
    """Tagged Image File Format."""

    settings: ClassVar[Settings] = {"Compression": "zip", "DateTime": FIXED_TIME}
