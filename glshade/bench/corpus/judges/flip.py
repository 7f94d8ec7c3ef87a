"""flip: the mean of FLIP over the picture (Andersson et al. 2020), with the best threshold for this corpus."""

from __future__ import annotations

import numpy as np

from glshade.bench.corpus.judges import Judge, Judgement, Pair, by_value
from glshade.image.metrics import flip_map
from glshade.image.srgb import srgb_to_linear


class Flip(Judge):
    """The mean of FLIP."""

    title = "FLIP mean"
    # FLIP's authors give no threshold.
    threshold = None

    def judge(self, pair: Pair) -> Judgement:
        if not all(np.isfinite(values).all() for values in pair.pixels):
            return by_value(np.nan, self.threshold)
        reference, test = (srgb_to_linear(codes[..., :3] / np.float32(255)) for codes in pair.codes)
        return by_value(float(flip_map(reference, test).mean(dtype=np.float64)), self.threshold)
