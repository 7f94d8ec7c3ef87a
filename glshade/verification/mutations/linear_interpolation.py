"""linear-interpolation: attributes such as normals are interpolated without perspective correction."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="linear-interpolation",
    description="attributes are interpolated linearly in the picture, without perspective correction",
    edits=((r"\bcentroid (in|out) ", r"noperspective centroid \1 "),),
    causes=("interpolation",),
)
