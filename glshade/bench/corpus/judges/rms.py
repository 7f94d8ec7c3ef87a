"""rms: the root of the mean squared difference of 8-bit codes, which may be 2."""

from __future__ import annotations

import numpy as np

from glshade.bench.corpus.judges import Judge, Judgement, Pair, by_value


class Rms(Judge):
    """The root mean square of the differences, in codes."""

    title = "RMS 2 codes"
    threshold = 2.0

    def judge(self, pair: Pair) -> Judgement:
        reference, test = (codes.astype(np.float64) for codes in pair.codes)
        return by_value(float(np.sqrt(np.mean((reference - test) ** 2))), self.threshold)
