"""exponent-squared: highlights are far too narrow."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="exponent-squared",
    description="every exponent is squared",
    edits=((r"m\.(exponent|pu) = ([^;]+);", r"m.\1 = (\2) * (\2);"),),
    causes=("parameter", "lobe"),
)
