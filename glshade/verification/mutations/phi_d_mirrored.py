"""phi-d-mirrored: the azimuth phi_d of a measured material is counted the other way round."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="phi-d-mirrored",
    description="phi_d of measured reflectance has the wrong sign",
    edits=((r"azimuth\(phi_d, x, y\)\)", r"azimuth(phi_d, x, -y))"),),
    causes=("table",),
)
