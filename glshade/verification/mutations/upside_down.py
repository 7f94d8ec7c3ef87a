"""upside-down: rows are read back in the wrong order."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="upside-down",
    description="the picture's rows run from bottom to top",
    picture=lambda pixels: pixels[::-1].copy(),
    causes=("flip",),
)
