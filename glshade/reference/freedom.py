"""Freedom: how far a driver may deviate from the reference within the OpenGL specification."""

from __future__ import annotations

from dataclasses import dataclass

from glshade.radiance.sampler import Rule
from glshade.reference.raster import SUBPIXELS, WINDOW


@dataclass(frozen=True)
class Freedom:
    """The errors of a driver's fixed functions. docs/tolerance.md explains how they are measured.

    name: the name of the driver.
    plane: the error of an attribute's plane equation (K in docs/tolerance.md) [roundings].
    window: the error of a vertex's window position (k in docs/tolerance.md) [roundings].
    snap: the distance by which a corner is moved before attributes are interpolated [pixels]; 0 if they are interpolated from
        the exact corners.
    rules: the rules for the level of detail between whose results the driver's level lies. One rule is enough if it was
        recognised.
    level: the error of the level of detail, below the least and above the largest result of these rules [levels].
    texel: the error of the texture filter's weights [texels]; 0 if it is not larger than that of float32.
    clips: whether triangles are clipped at the sides of the view, and not only at the near and far plane.
    """

    name: str = "llvmpipe"
    plane: float = 2.0
    window: float = WINDOW
    snap: float = 0.0
    rules: tuple[Rule, ...] = ("length",)
    level: float = 0.05
    texel: float = 0.0
    clips: bool = True


# The errors of Mesa's llvmpipe. `glshade verify` uses the errors that it measures in their place (glshade/driver/freedom.py).
LLVMPIPE = Freedom()
# The errors that a driver may have that was not measured: attributes are interpolated from snapped corners, the level of detail
# is any that the specification allows, and texture filters have weights of 8 bits.
UNMEASURED = Freedom("unmeasured", snap=1 / SUBPIXELS, rules=("largest", "sum"), level=0.1, texel=1 / 256)
