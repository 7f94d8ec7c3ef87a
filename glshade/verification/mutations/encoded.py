"""encoded: the picture is sRGB-encoded although it should be linear."""

import numpy as np

from glshade.image.srgb import linear_to_srgb
from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="encoded",
    description="the picture is sRGB-encoded although it should be linear",
    picture=lambda pixels: np.concatenate([linear_to_srgb(pixels[..., :3]), pixels[..., 3:]], axis=2),
    causes=("encode",),
)
