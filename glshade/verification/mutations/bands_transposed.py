"""bands-transposed: the matrix from bands of a spectrum to RGB is transposed."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="bands-transposed",
    description="the matrix that turns bands of a spectrum into RGB is transposed",
    edits=((r"u_rgb_from_bands \* \(c\);", r"c * u_rgb_from_bands;"),),
    # Each lamp has another colour on each material.
    causes=("light",),
)
