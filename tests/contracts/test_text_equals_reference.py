"""Contract: a model's GLSL, run in float64, has the value of its float64 function, for every option and at extremes."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from support.extremes import FACTOR, at_extremes, exact, joined, ordinary, pairs
from support.strategies import directions

from glshade import BRDFS, evaluate

# The largest difference that is allowed, relative to max(1, |f cos|). The constants in the GLSL are float32 numbers.
ALLOWED = 2e-6
COUNT = 20_000

pytestmark = pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="needs glslangValidator (glslang-tools)")


@pytest.mark.parametrize("name", BRDFS)
def test_text_equals_reference_at_ordinary_values(name: str) -> None:
    l, v = directions(COUNT, 1), directions(COUNT, 2)
    for material in ordinary(name, 3):
        value = evaluate(material, l, v)
        error = np.abs(evaluate(material, l, v, on="text") - value) / np.maximum(1, np.abs(value))
        assert error.max() <= ALLOWED, material


@pytest.mark.slow
@pytest.mark.parametrize("name", BRDFS)
def test_text_equals_reference_at_extremes(name: str) -> None:
    l, v, case = joined(pairs())
    for material in at_extremes(name, 96):
        value, conditioning = exact(material, l, v)
        allowed = np.maximum(ALLOWED * np.maximum(1, np.abs(value)), FACTOR * conditioning)
        error = np.abs(evaluate(material, l, v, on="text") - value) / allowed
        worst = np.unravel_index(np.argmax(error), error.shape)
        assert error[worst] <= 1, f"{material!r}, {case[worst[0]]}, l {l[worst[0]]}, v {v[worst[0]]}: {value[worst]}"
