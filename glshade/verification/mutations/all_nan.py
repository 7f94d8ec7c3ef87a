"""all-nan: every value in the picture is NaN."""

import numpy as np

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="all-nan",
    description="every value is NaN",
    picture=lambda pixels: np.full_like(pixels, np.nan),
    causes=("not finite",),
)
