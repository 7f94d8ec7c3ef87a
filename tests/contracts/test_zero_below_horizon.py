"""Property: f cos is exactly 0 where the light or the viewer is in the horizon or below it, so that no light leaks through."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.strategies import directions, materials

from glshade import BRDFS, Renderer, evaluate

ABOVE, BELOW = directions(96, 1), directions(96, 2, below=True)
LEVEL = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0.6, -0.8, 0]], dtype=np.float32)


@pytest.mark.parametrize("on", ["reference", "vertex", "fragment"])
@pytest.mark.parametrize("name", BRDFS)
@settings(max_examples=5)
@given(data=st.data())
def test_nothing_from_below(name: str, on: Any, renderer: Renderer, data: Any) -> None:
    material = data.draw(materials(name))
    dark = np.concatenate([BELOW, LEVEL])
    for l, v in ((ABOVE[:, None], dark), (dark[:, None], ABOVE), (dark[:, None], dark)):
        assert np.all(evaluate(material, l, v, on=on, context=renderer.context) == 0)
