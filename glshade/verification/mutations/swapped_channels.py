"""swapped-channels: channels are read back in the wrong order."""

import numpy as np

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="swapped-channels",
    description="red and blue are exchanged",
    picture=lambda pixels: np.concatenate([pixels[..., 2::-1], pixels[..., 3:]], axis=2),
    causes=("exchange",),
)
