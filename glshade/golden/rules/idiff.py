"""idiff: the thresholds of OpenImageIO's command of this name, with its defaults."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glshade.golden.pair import Pair
from glshade.golden.result import Finding, Outcome
from glshade.golden.rules import Rule

# The number of pixels that a percentage allows is rounded by less than this: 7 of 1000 pixels are 0.7 %, while 0.7 / 100 x 1000
# is less than 7.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Idiff(Rule):
    """A picture fails or warns by the errors of its pixels, as in OpenImageIO's idiff (main in src/idiff/idiff.cpp).

    The error of a pixel is the largest absolute difference of its channels. 8-bit codes count as code / 255. As in idiff since
    version 2.3.19, the picture is the same, without a warning, if no more than `allowfailures` pixels exceed `fail`; all
    other settings are then left out of account.

    fail, warn: the errors above which a pixel counts.
    failpercent, warnpercent: the share of the pixels that may count [%].
    hardfail, hardwarn: the error that no pixel may exceed.
    allowfailures: the number of pixels that may exceed `fail`.
    """

    fail: float = 1e-6
    failpercent: float = 0.0
    hardfail: float = math.inf
    warn: float = 1e-6
    warnpercent: float = 0.0
    hardwarn: float = math.inf
    allowfailures: int = 0

    def judge(self, pair: Pair) -> Finding:
        if np.count_nonzero(pair.errors > self.fail) <= self.allowfailures:
            return Finding(Outcome.SAME)
        for outcome, threshold, percent, hard in (
            (Outcome.FAIL, self.fail, self.failpercent, self.hardfail),
            (Outcome.WARN, self.warn, self.warnpercent, self.hardwarn),
        ):
            for most, allowed in ((threshold, percent / 100 * pair.size), (hard, 0.0)):
                count = int(np.count_nonzero(pair.errors > most))
                if count > allowed + ROUNDING:
                    return Finding(outcome, f"{count} of {pair.size} pixels differ by more than {most:g}")
        return Finding(Outcome.SAME)
