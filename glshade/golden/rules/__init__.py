"""Rules: one module each, found by its presence. A rule says how much two layers of the same size may differ.

The module `codes` holds the class `Codes`, which derives from Rule. A layer with an infinite or NaN value, and a file that
lacks a layer or a channel, fail before a rule is asked.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from glshade.found import Found

if TYPE_CHECKING:
    from glshade.golden.pair import Pair
    from glshade.golden.result import Finding


class Rule:
    """A rule. A rule with settings is a dataclass, whose defaults are used if no setting is given."""

    def judge(self, pair: Pair) -> Finding:
        """Returns the judgement of two layers."""
        raise NotImplementedError


RULES: Found[Rule] = Found("glshade.golden.rules", Path(__file__).parent)
