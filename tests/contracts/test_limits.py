"""Property: where a model declares that it equals another (`limits`), both have the same values in Python and both stages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.extremes import FACTOR, ORDINARY, exact, joined, measured, pairs

from glshade import BRDFS, Renderer

LIMITS = [pytest.param(name, limit, id=f"{name}: {limit.says}") for name in BRDFS for limit in BRDFS[name].limits()]


@pytest.mark.parametrize(("name", "limit"), LIMITS)
def test_is_reached(name: str, limit: Any, renderer: Renderer) -> None:
    assert name in {limit.one.brdf, limit.other.brdf}
    l, v, _ = joined(pairs())
    (one, uncertain), (other, _) = (exact(material, l, v) for material in (limit.one, limit.other))
    assert one.max() > 0
    difference = np.abs(one - other)
    assert np.all(difference <= limit.within * np.maximum(np.abs(one), np.abs(other)) + 1e-30), limit.says
    # On the GPU each of the two is as exact as its own model.
    enough = FACTOR * uncertain + (ORDINARY + limit.within) * np.maximum(1, np.abs(one)) + difference
    for stage in ("vertex", "fragment"):
        gpu = [measured(material, stage, renderer, l, v) for material in (limit.one, limit.other)]  # type: ignore[arg-type]
        assert np.all(np.abs(gpu[0] - gpu[1].astype(np.float64)) <= 2 * enough), limit.says
