"""idiff: the thresholds of OpenImageIO's command of this name, with its defaults."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glshade.golden.pair import Pair
from glshade.golden.result import Finding, Outcome
from glshade.golden.rules import Rule


@dataclass(frozen=True)
class Idiff(Rule):
    """A picture fails or warns by the errors of its pixels, as the documentation of OpenImageIO's idiff says.

    The error of a pixel is the largest absolute difference of its channels. 8-bit codes count as code / 255.

    fail, warn: the errors above which a pixel counts.
    failpercent, warnpercent: the share of the pixels that may count [%].
    hardfail, hardwarn: the error that no pixel may exceed.
    allowfailures: the number of pixels that may differ by any amount, in spite of all other settings.
    """

    fail: float = 1e-6
    failpercent: float = 0.0
    hardfail: float = math.inf
    warn: float = 1e-6
    warnpercent: float = 0.0
    hardwarn: float = math.inf
    allowfailures: int = 0

    def judge(self, pair: Pair) -> Finding:
        for outcome, threshold, percent, hard in (
            (Outcome.FAIL, self.fail, self.failpercent, self.hardfail),
            (Outcome.WARN, self.warn, self.warnpercent, self.hardwarn),
        ):
            count = int(np.count_nonzero(pair.errors > threshold))
            over = int(np.count_nonzero(pair.errors > hard))
            if max(count, over) <= self.allowfailures:
                continue
            if count > percent / 100 * pair.size:
                return Finding(outcome, f"{count} of {pair.size} pixels differ by more than {threshold:g}")
            if over:
                return Finding(outcome, f"{over} of {pair.size} pixels differ by more than {hard:g}")
        return Finding(Outcome.SAME)
