"""Reference: the float64 renderer in NumPy, written after the OpenGL specification and the models' papers.

Its stages are named as in the specification: prepare (inputs.py) -> rasterise and clip (raster.py, clip.py) -> depth test
(raster.resolve) -> interpolate, sample textures and shade (interpolate.py, shade.py) -> blend (picture.py).
"""

from typing import TYPE_CHECKING

from glshade.found import lazily

if TYPE_CHECKING:
    from glshade.reference.picture import radiance as radiance
    from glshade.reference.picture import render as render

__getattr__ = lazily("glshade.reference", {"render": "picture", "radiance": "picture"})
