"""one-nan: a single value in the picture is NaN."""

import numpy as np

from glshade.verification.mutations._mutation import Array, Mutation


def _with_nan(pixels: Array) -> Array:
    """Returns the picture with NaN in the red channel of its middle pixel."""
    result = pixels.copy()
    result[pixels.shape[0] // 2, pixels.shape[1] // 2, 0] = np.nan
    return result


MUTATION = Mutation(
    name="one-nan",
    description="one value is NaN",
    picture=_with_nan,
    causes=("not finite",),
)
