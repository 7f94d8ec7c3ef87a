"""two-sided: light from behind a surface shines through it."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="two-sided",
    description="n.l loses its sign",
    edits=((r"float NoL = dot\(f\.n, l\);", r"float NoL = abs(dot(f.n, l));"),),
    causes=("two-sided",),
)
