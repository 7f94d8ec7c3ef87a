"""FLIP: its value, the layers that have one, and the limit `max_flip`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.golden.flip import mean_flip
from glshade.golden.judge import compare_files
from glshade.golden.pair import Pair
from glshade.golden.result import Outcome
from glshade.golden.rules import RULES
from glshade.image import file as picture_file
from glshade.image.contents import PictureContents
from glshade.image.metrics import flip_map
from glshade.image.srgb import srgb_to_linear

RGB, RGBA = ("R", "G", "B"), ("R", "G", "B", "A")


def pair(reference: Any, test: Any, channels: tuple[str, ...] = RGB) -> Pair:
    return Pair("", channels, reference, test)


def noise(kind: str, channels: int, seed: int = 0) -> Any:
    random = np.random.default_rng(seed)
    if kind == "codes":
        return random.integers(0, 256, (50, 60, channels), dtype=np.uint8)
    return random.random((50, 60, channels), dtype=np.float32)


@settings(max_examples=20)
@given(st.integers(0, 40), st.integers(0, 50), st.integers(1, 9), st.integers(1, 9), st.sampled_from(["codes", "floats"]))
def test_the_box_has_the_values_of_the_whole_picture(top: int, left: int, rows: int, columns: int, kind: str) -> None:
    """FLIP of a box that was cut out with its surroundings is FLIP of the same pixels in the whole picture."""
    reference = noise(kind, 3)
    test = reference.copy()
    box = (slice(top, top + rows), slice(left, left + columns))
    test[box] = test[box][..., ::-1] // 2 if kind == "codes" else test[box][..., ::-1] / 2
    whole = [srgb_to_linear(p / np.float32(255)) if kind == "codes" else p for p in (reference, test)]
    expected = flip_map(whole[0], whole[1], None if kind == "codes" else 2.0)[box].mean()
    assert expected > 0.01
    assert mean_flip(pair(reference, test)) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("kind", ["codes", "floats"])
def test_black_and_white_differ_by_nearly_1_and_equal_pictures_by_0(kind: str) -> None:
    black = np.zeros_like(noise(kind, 3))
    white = black + (255 if kind == "codes" else 1)
    assert mean_flip(pair(black, white.astype(black.dtype))) == pytest.approx(0.967, abs=1e-3)
    assert mean_flip(pair(black, black.copy())) == 0.0


def test_one_code_is_hardly_visible_and_a_lost_object_is() -> None:
    reference = noise("codes", 3) // 2 + 50
    assert 0 < (mean_flip(pair(reference, reference + 1)) or 0) < 0.05
    test = reference.copy()
    test[20:23, 30:33] = 0
    assert (mean_flip(pair(reference, test)) or 0) > 0.3


@pytest.mark.parametrize("kind", ["codes", "floats"])
def test_alpha_alone_counts(kind: str) -> None:
    """A black object that is gone from alpha differs over white alone, and a white one over black alone."""
    for colour in (0, 1):
        reference = np.zeros((30, 30, 4), dtype=np.float32)
        reference[5:15, 5:15] = (colour, colour, colour, 1)
        test = np.zeros_like(reference)
        if kind == "codes":
            test[..., :3] = reference[..., :3]
            reference, test = ((255 * p).astype(np.uint8) for p in (reference, test))
        assert (mean_flip(pair(reference, test, RGBA)) or 0) > 0.5


@pytest.mark.parametrize("high", [10.0, 1000.0, 1e9])
def test_highlights_are_told_apart(high: float) -> None:
    a, b = (np.full((24, 24, 3), value, dtype=np.float32) for value in (high, high / 2))
    assert (mean_flip(pair(a, b)) or 0) > 0.1


@pytest.mark.parametrize("high", [1e19, 3e38])
def test_enormous_values_are_as_bright_as_can_be(high: float) -> None:
    a = np.full((24, 24, 3), high, dtype=np.float32)
    assert mean_flip(pair(a, np.zeros_like(a))) == mean_flip(pair(np.zeros_like(a), a)) == pytest.approx(0.967, abs=1e-3)


@pytest.mark.parametrize(
    ("channels", "has"),
    [(RGB, True), (RGBA, True), (("Y",), True), (("Y", "A"), True), (("X", "Y", "Z"), False), (("I",), False)],
)
def test_layers_without_colours_have_no_flip(channels: tuple[str, ...], has: bool) -> None:
    values = noise("floats", len(channels))
    assert (mean_flip(pair(values, values / 2, channels)) is not None) is has
    assert mean_flip(Pair("CryptoObject00", channels, values, values / 2)) is None


class TestLimit:
    """The limit of FLIP judges beside the rule."""

    @pytest.fixture
    def files(self, tmp_path: Path) -> tuple[Path, Path]:
        paths = tmp_path / "a.png", tmp_path / "b.png"
        for path, value in zip(paths, (100, 130), strict=True):
            pixels = np.full((20, 20, 3), value, dtype=np.uint8)
            picture_file.write(path, PictureContents(pixels, "srgb", premultiplied=False))
        return paths

    def test_it_is_told_only_if_it_is_asked_for(self, files: tuple[Path, Path]) -> None:
        loose = RULES["idiff"](fail=1.0)
        for most, told in ((None, False), (np.inf, True)):
            result = compare_files(*files, loose, max_flip=most)
            assert result.outcome is Outcome.SAME
            (layer,) = result.layers
            assert layer.metrics is not None
            assert (layer.metrics.flip is not None) is told

    def test_it_judges(self, files: tuple[Path, Path]) -> None:
        loose = RULES["idiff"](fail=1.0)
        value = mean_flip(pair(*(np.full((20, 20, 3), v, dtype=np.uint8) for v in (100, 130))))
        assert value is not None
        assert compare_files(*files, loose, max_flip=value + 1e-4).outcome is Outcome.SAME
        result = compare_files(*files, loose, max_flip=0.05)
        assert result.outcome is Outcome.FAIL
        assert result.reason == f"FLIP is {value:.3g}, and at most 0.05 is allowed"

    def test_it_does_not_lift_the_rule(self, files: tuple[Path, Path]) -> None:
        result = compare_files(*files, RULES["codes"](), max_flip=1.0)
        assert result.outcome is Outcome.FAIL
        assert "FLIP" not in result.reason
