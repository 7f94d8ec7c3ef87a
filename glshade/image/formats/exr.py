"""OpenEXR: linear float32 numbers in any number of named channels."""

from typing import ClassVar

from glshade.image.formats import FIXED_TIME, PictureFormat, Settings


class Exr(PictureFormat):
    """OpenEXR."""

    floats = True
    layers = True
    window = True
    matrices = True
    metadata = "attributes"
    settings: ClassVar[Settings] = {"Compression": "zip", "DateTime": FIXED_TIME}
