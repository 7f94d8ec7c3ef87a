"""falloff: light falls off too slowly or too fast."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="falloff",
    description="the falloffs 1/r and 1/r^2 are exchanged",
    edits=(
        (r"1\.0 / max\(dot\(to_light, to_light\), r_min \* r_min\)", r"1.0 / max(length(to_light), sqrt(r_min * r_min))"),
        (r"1\.0 / max\(length\(to_light\), r_min\)", r"1.0 / max(dot(to_light, to_light), r_min * r_min)"),
    ),
    causes=("falloff",),
)
