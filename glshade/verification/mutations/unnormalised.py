"""unnormalised: interpolated normals keep the length that interpolation gave them."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="unnormalised",
    description="interpolated normals are not normalised again",
    edits=(
        (r"return Frame\(side \* unit\(", r"return Frame(side * ("),
        (r"vec3 n = unit\(normal\);", r"vec3 n = normal;"),
    ),
    causes=("normals",),
)
