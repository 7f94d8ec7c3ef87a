"""mirrored: tangent frames have the opposite handedness, so that the details of normal maps are mirrored."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="mirrored",
    description="tangent frames have the opposite handedness",
    edits=((r"cross\(n, t\) \* tangent\.w", r"cross(n, t) * -tangent.w"),),
    causes=("tangents",),
)
