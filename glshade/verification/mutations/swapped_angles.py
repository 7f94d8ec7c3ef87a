"""swapped-angles: the table of a measured material is read with its first two axes exchanged."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="swapped-angles",
    description="theta_h and theta_d of a table of measured reflectance are exchanged",
    edits=((r"vec3\(sqrt\(theta_h\), theta_d, (azimuth\(phi_d, x, y\))\)", r"vec3(theta_d, sqrt(theta_h), \1)"),),
    causes=("table",),
)
