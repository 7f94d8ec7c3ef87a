"""codes: `glshade compare` without a scene, by its default rule."""

from __future__ import annotations

from glshade.bench.corpus.judges import Judge, Judgement, Pair
from glshade.golden.judge import compare_files
from glshade.golden.result import Outcome
from glshade.golden.rules import RULES


class Codes(Judge):
    """glshade without the scene."""

    title = "glshade without"

    def judge(self, pair: Pair) -> Judgement:
        result = compare_files(pair.reference, pair.test, RULES["codes"]())
        return Judgement(result.outcome is not Outcome.SAME, float(result.outcome), result.reason)
