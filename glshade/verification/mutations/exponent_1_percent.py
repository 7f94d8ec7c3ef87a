"""exponent-1-percent: highlights are slightly too narrow."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="exponent-1-percent",
    description="every exponent is 1 % too large",
    edits=((r"m\.(exponent|pu) = ([^;]+);", r"m.\1 = 1.01 * (\2);"),),
    causes=("parameter",),
)
