"""light-1-percent: pictures are slightly too bright."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="light-1-percent",
    description="every light with a direction is 1 % too strong",
    edits=((r"= illuminate\(light, p, l\);", r"= 1.01 * illuminate(light, p, l);"),),
    causes=("light", "exposure"),
)
