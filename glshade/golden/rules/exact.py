"""exact: no value differs."""

from glshade.golden.pair import Pair
from glshade.golden.result import Finding, Outcome
from glshade.golden.rules import Rule


class Exact(Rule):
    """All values of the pictures are equal."""

    def judge(self, pair: Pair) -> Finding:
        if not pair.count:
            return Finding(Outcome.SAME)
        return Finding(Outcome.FAIL, f"{pair.count} of {pair.size} pixels differ")
