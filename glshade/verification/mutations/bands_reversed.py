"""bands-reversed: the bands of a spectrum are taken in the wrong order."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="bands-reversed",
    description="of each three bands of a spectrum, the first counts as the last",
    edits=((r"u_rgb_from_bands \* \(c\);", r"u_rgb_from_bands * c.bgr;"),),
    # Each lamp has another colour on each material.
    causes=("light",),
)
