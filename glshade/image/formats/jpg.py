"""JPEG: 8 bits a channel, compressed with loss, without alpha."""

from typing import ClassVar

from glshade.image.formats import PictureFormat, Settings


class Jpg(PictureFormat):
    """JPEG at quality 95 of 100."""

    alpha = False
    settings: ClassVar[Settings] = {"Compression": "jpeg:95"}
