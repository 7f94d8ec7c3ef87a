"""PNG: 8 bits a channel, compressed without loss."""

from typing import ClassVar

from glshade.image.formats import PictureFormat, Settings


class Png(PictureFormat):
    """Portable Network Graphics."""

    metadata = "attributes"
    settings: ClassVar[Settings] = {
        # Level 6 of 9 takes three times as long for files two thirds the size.
        "png:compressionLevel": 1,
        # 32 is libpng's number for the filter "up", which stores the difference to the pixel above. By default libpng tries all
        # five filters, which takes twice as long and makes rendered pictures no smaller.
        "png:filter": 32,
    }
