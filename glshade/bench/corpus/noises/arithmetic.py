"""Noise of arithmetic: sums, powers and square roots are rounded otherwise. GLSL 3.30 sets no bounds for their errors.

GLSL 4.10 later allowed errors of 2.5 ulps of a division, and of 3 + 2 |x| ulps of exp2(x). The edits stay within them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.corpus.case import Case
from glshade.bench.corpus.kinds import noise

Array = NDArray[Any]
# 2 and 3 ulps of numbers in [1, 2), relative to them.
TWO_ULPS, THREE_ULPS = "2.4e-7", "3.6e-7"


@noise
def power_rounded(case: Case) -> Array:
    """The result of exp2 is 3 ulps too large. GLSL 4.10 allows 3 + 2 |x|."""
    return case.draw(edits=[(r"\bexp2\(", f"(1.0 + {THREE_ULPS}) * exp2(")])


@noise
def square_root_rounded(case: Case) -> Array:
    """The result of inversesqrt is 2 ulps too large, which GLSL 4.10 allows."""
    return case.draw(edits=[(r"\binversesqrt\(", f"(1.0 + {TWO_ULPS}) * inversesqrt(")])


@noise
def reflectance_rounded(case: Case) -> Array:
    """Each light's share is off by up to 2 ulps, which differ from pixel to pixel, as another order of products causes."""
    error = f"(1.0 + {TWO_ULPS} * sin(float(int(1e6 * f.n.x))))"
    return case.draw(edits=[(r"c \+= e \* brdf_cos", f"c += {error} * e * brdf_cos")])


@noise
def normals_rounded(case: Case) -> Array:
    """Shading normals are off by an ulp in one coordinate, as interpolation in another order causes."""
    return case.draw(edits=[(r"Frame f = frame\(side\);", r"\g<0> f.n.y *= 1.0 + 1.2e-7;")])


@noise
def last_bit(case: Case) -> Array:
    """The last bit of linear values differs at random before they are encoded or stored."""
    return case.of_linear(_off_by(case, 1))


@noise
def last_two_bits(case: Case) -> Array:
    """Linear values are off by up to two units in the last place before they are encoded or stored."""
    return case.of_linear(_off_by(case, 2))


def _off_by(case: Case, most: int) -> Array:
    """Returns the linear picture, off by up to `most` units in the last place. Values of 0 and alpha stay as they are."""
    pixels = case.linear.astype(np.float32)
    steps = case.random(f"off-by-{most}").integers(-most, most + 1, pixels[..., :3].shape)
    colours = pixels[..., :3]
    bare = np.all(pixels == pixels[0, 0], axis=2, keepdims=True)
    pixels[..., :3] = np.where(bare, colours, colours + steps * np.spacing(np.abs(colours)) * (colours != 0))
    return pixels
