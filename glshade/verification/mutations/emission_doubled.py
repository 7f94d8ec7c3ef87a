"""emission-doubled: surfaces emit too much light."""

from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation(
    name="emission-doubled",
    description="surfaces emit twice as much light",
    # The definition is followed by a brace, and a use by the end of an expression.
    edits=((r"\bemission\(\)(?= \+|;)", r"2.0 * emission()"),),
    causes=("emission",),
)
