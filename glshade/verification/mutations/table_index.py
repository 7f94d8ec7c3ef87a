"""table-index: the table of a measured material is read one cell beside the right one along theta_h."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="table-index",
    description="the index of theta_h in a table of measured reflectance is off by one",
    edits=(
        (
            r"vec3\(sqrt\(theta_h\), theta_d, (azimuth\(phi_d, x, y\))\)",
            r"vec3(sqrt(theta_h) + 1.0 / float(textureSize(u_reflectance, 0).x), theta_d, \1)",
        ),
    ),
    causes=("table",),
)
