"""black: nothing was drawn."""

import numpy as np

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="black",
    description="every value is 0",
    picture=np.zeros_like,
    causes=("empty",),
)
