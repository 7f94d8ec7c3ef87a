"""swapped-tangents: an anisotropic highlight is turned by 90 degrees."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="swapped-tangents",
    description="tangent and bitangent are exchanged",
    edits=(
        (r"return Frame\(side \* n, t, cross\(n, t\) \* tangent\.w\);", r"return Frame(side * n, cross(n, t) * tangent.w, t);"),
    ),
    causes=("tangents",),
)
