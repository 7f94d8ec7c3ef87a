"""shifted: pixel centres are off by one."""

import numpy as np

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="shifted",
    description="the picture is moved right by one pixel",
    picture=lambda pixels: np.roll(pixels, 1, axis=1),
    causes=("shift",),
)
