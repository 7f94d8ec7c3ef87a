"""normal-0.1-degree: every normal is turned by 0.1 degree, so that all shading changes slightly."""

from glshade.verification.mutations._mutation import Mutation

# 0.00174533 is 0.1 degree in radians. The cross product is perpendicular to the normal.
_TURNED = "normalize(f.n + 0.00174533 * normalize(cross(f.n, vec3(0.36, 0.48, 0.8))))"
MUTATION = Mutation(
    name="normal-0.1-degree",
    description="every normal is turned by 0.1 degree",
    edits=((r"Frame f = frame\(side\);", f"Frame f = frame(side); f.n = {_TURNED};"),),
    causes=("normals",),
)
