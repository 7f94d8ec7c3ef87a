"""Small pictures: reducing keeps the mean or the largest value, and errors have one scale of colours."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.image import file as picture_file
from glshade.page.ramp import LEAST, RAMP, heat
from glshade.page.small import as_base64, smaller

SIDES = st.integers(1, 40)


@given(height=SIDES, width=SIDES, longest=st.integers(1, 12), seed=st.integers(0, 99))
def test_smaller_pictures_keep_the_largest_value_and_the_range(height: int, width: int, longest: int, seed: int) -> None:
    picture = np.random.default_rng(seed).random((height, width, 3)).astype(np.float32)
    largest, mean = smaller(picture, np.maximum, longest), smaller(picture, np.add, longest)
    assert max(largest.shape[:2]) <= longest
    assert largest.shape == mean.shape
    assert (largest.max(axis=(0, 1)) == picture.max(axis=(0, 1))).all()
    assert mean.min() >= picture.min() - 1e-6
    assert (mean <= largest + 1e-6).all()


@given(height=SIDES, width=SIDES, longest=st.integers(1, 12))
def test_a_uniform_picture_stays_uniform(height: int, width: int, longest: int) -> None:
    grey = np.full((height, width, 3), 200, dtype=np.uint8)
    assert (smaller(grey, np.add, longest) == 200).all()


@pytest.mark.parametrize(("suffix", "tolerance"), [("png", 0), ("jpg", 4)])
def test_base64_is_a_file_of_the_format(tmp_path: Path, suffix: str, tolerance: int) -> None:
    pixels = np.full((8, 6, 3), (10, 120, 250), dtype=np.uint8)
    path = tmp_path / f"small.{suffix}"
    path.write_bytes(base64.b64decode(as_base64(pixels, suffix)))
    read: Any = picture_file.read_part(path, picture_file.parts(path)[0])
    assert np.abs(read.astype(int) - pixels).max() <= tolerance


def test_the_ramp_gets_lighter_all_the_way() -> None:
    lightness = RAMP @ (0.2126, 0.7152, 0.0722)
    assert (np.diff(lightness) > 0).all()


@given(errors=st.lists(st.floats(0, 1e3), min_size=1, max_size=20), greatest=st.floats(1e-6, 1e3))
def test_a_colour_stands_for_one_error_on_a_fixed_scale(errors: list[float], greatest: float) -> None:
    together = heat(np.array([errors]), greatest)[0]
    for index, error in enumerate(errors):
        alone = heat(np.array([[error]]), greatest)[0]
        assert (alone[0, 0] == together[0, index]).all()
    assert (heat(np.array([[0.0, LEAST]]), greatest)[0] == RAMP[0]).all()
    assert (heat(np.array([[greatest, np.inf, np.nan]]), greatest)[0] == RAMP[-1]).all()
