"""Image: pictures in memory, picture files, layers, view transforms, and measures of how two pictures differ."""

from typing import TYPE_CHECKING

from glshade.found import lazily

if TYPE_CHECKING:
    from glshade.image.image import Image as Image

__getattr__ = lazily("glshade.image", {"Image": "image"})
