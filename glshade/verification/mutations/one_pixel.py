"""one-pixel: a single pixel is wrong."""

import numpy as np

from glshade.verification.mutations._mutation import Array, Mutation


def _with_bright_pixel(pixels: Array) -> Array:
    """Returns the picture with its brightest pixel twice as bright. The brightest pixel always shows a surface."""
    result = pixels.copy()
    brightest = np.unravel_index(np.argmax(pixels[..., :3].sum(axis=2)), pixels.shape[:2])
    result[brightest] *= 2
    return result


MUTATION = Mutation(
    name="one-pixel",
    description="one pixel is twice as bright",
    picture=_with_bright_pixel,
    # Nearly any fault would explain one pixel, so none is named.
    causes=("unknown",),
)
