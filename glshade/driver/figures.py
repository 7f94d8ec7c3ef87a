"""Figures: rounds measured numbers for reports."""

from __future__ import annotations

import math
from typing import Any


def rounded(x: Any) -> float:
    """Returns x rounded to four significant digits, which is enough to compare drivers.

    Infinity and NaN become 1e308, because JSON has neither.
    """
    return float(f"{float(x):.4g}") if math.isfinite(x) else 1e308
