"""exchanged: the directions to the light and to the viewer are exchanged, which changes models that are not reciprocal."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="exchanged",
    description="l and v are exchanged",
    edits=((r"brdf_cos\(m, f, l, v\)", r"brdf_cos(m, f, v, l)"),),
    causes=("directions",),
)
