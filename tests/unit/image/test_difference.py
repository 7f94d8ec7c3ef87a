"""Difference: the numbers of a comparison, against arithmetic by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glshade import compare
from glshade.image.metrics import errors


def test_the_numbers_of_four_pixels() -> None:
    a = np.zeros((2, 2, 3))
    b = np.array([[[0, 0, 0], [0, 0.25, 0.125]], [[-0.5, 0, 0], [0, 0, 1]]])
    difference = compare(a, b, tolerance=0.25)
    assert difference.map.tolist() == [[0, 0.25], [0.5, 1]]
    assert difference.worst == 1
    assert difference.differing == 2
    assert difference.rmse == pytest.approx(math.sqrt((0.0625 + 0.25 + 1) / 4))
    # The position 0.999 (4 - 1) = 2.997 in the sorted errors lies between 0.5 and 1.
    assert difference.p999 == pytest.approx(0.5 + 0.997 * 0.5)


@pytest.mark.parametrize(("outliers", "p999"), [(0, 0.0), (1, 0.0), (2, 7.0), (3, 7.0)])
def test_p999_forgives_one_pixel_in_a_thousand(outliers: int, p999: float) -> None:
    """Of 1001 sorted errors, p999 is the last but one."""
    a = np.zeros((7, 143, 3))
    b = a.copy()
    b.reshape(-1, 3)[5 : 5 + outliers, 1] = 7
    assert compare(a, b).p999 == p999
    assert errors(b, a, flip=False).p999 == p999


def test_masked_pixels_count_as_equal() -> None:
    a = np.zeros((1, 2, 3))
    b = np.ones((1, 2, 3))
    difference = compare(a, b, mask=np.array([[True, False]]))
    assert difference.map.tolist() == [[0, 1]]
    assert difference.differing == 1
    assert difference.rmse == pytest.approx(math.sqrt(0.5))
