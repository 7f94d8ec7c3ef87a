"""Freedom: how far a driver may deviate from the reference within the OpenGL specification."""

from __future__ import annotations

from dataclasses import dataclass

from glshade.reference.raster import SUBPIXELS

# The largest relative error of one float32 rounding.
U = 2.0**-24


@dataclass(frozen=True)
class Freedom:
    """The errors of a driver's fixed functions. docs/tolerance.md explains how they are measured.

    name: the name of the driver.
    plane: the error of an attribute's plane equation (K in docs/tolerance.md) [roundings].
    window: the error of a vertex's window position (k in docs/tolerance.md) [roundings].
    snap: the distance by which a corner is moved before attributes are interpolated [pixels]; 0 if they are interpolated from
        the exact corners.
    level: the error of the level of detail [levels].
    texel: the spacing of the values that the texture filter's weights can have [texels]; 0 if the weights are floats.
    """

    name: str = "llvmpipe"
    plane: float = 2.0
    window: float = 2.0
    snap: float = 0.0
    level: float = 0.05
    texel: float = 0.0


LLVMPIPE = Freedom()


# The assumption about graphics processors that were not measured: attributes are interpolated from snapped corners, and
# texture filters have weights of 8 bits.
HARDWARE = Freedom("hardware", snap=1 / SUBPIXELS, level=0.1, texel=1 / 256)


def freedom_of(renderer: str) -> Freedom:
    """The Freedom of the driver with a GL_RENDERER string; an empty string means llvmpipe."""
    return LLVMPIPE if "llvmpipe" in renderer.lower() or not renderer else HARDWARE
