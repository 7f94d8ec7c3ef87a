"""Faults of the whole picture: each is named, whatever the picture, and nothing is named for a change that none explains."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.golden.pair import Pair
from glshade.golden.result import Cause
from glshade.golden.whole_picture import not_finite, whole_picture_causes
from glshade.image.srgb import linear_to_srgb

HEIGHT, WIDTH = 40, 56


def picture(seed: int, channels: int = 3) -> Any:
    """Returns a smooth picture (H, W, C) of 8-bit codes without any symmetry, from 20 to 235."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / 20
    waves = [
        sum(np.sin(a * x + b * y + c) for a, b, c in random.uniform(-3, 3, (4, 3))) + 0.5 * random.uniform(-1, 1) * x
        for _ in range(channels)
    ]
    scaled = [20 + 215 * (wave - wave.min()) / np.ptp(wave) for wave in waves]
    return np.stack(scaled, axis=2).astype(np.uint8)


def causes(truth: Any, test: Any) -> tuple[Cause, ...]:
    """Returns the causes of the change between two pictures."""
    pair = Pair("", tuple("RGBA"[: truth.shape[2]]), truth, test)
    return whole_picture_causes(truth, test, truth.shape[2] == 4, pair.changed)


def codes(values: Any) -> Any:
    """Returns numbers from 0 to 1 as codes."""
    return np.rint(255 * np.clip(values, 0, 1)).astype(np.uint8)


def grey(pixels: Any) -> Any:
    """Returns a picture of codes without its colours."""
    return np.repeat(codes(pixels @ np.array([0.2126, 0.7152, 0.0722]) / 255)[..., None], 3, axis=2)


FAULTS: dict[str, tuple[Callable[[Any], Any], str, str]] = {
    "upside down": (lambda p: p[::-1], "flip", "whole picture flipped upside down"),
    "mirrored": (lambda p: p[:, ::-1], "flip", "whole picture mirrored left to right"),
    "turned": (lambda p: p[::-1, ::-1], "turn", "whole picture turned by 180 degrees"),
    "red and blue": (lambda p: p[..., ::-1], "exchange", "channels r, b exchanged"),
    "rotated channels": (lambda p: p[..., [1, 2, 0]], "exchange", "channels r, g, b hold g, b, r"),
    "encoded twice": (lambda p: codes(linear_to_srgb(p / 255)), "encode", "whole picture encoded twice"),
    "inverted": (lambda p: 255 - p, "encode", "colours inverted"),
    "no green": (lambda p: p * np.array([1, 0, 1], dtype=np.uint8), "channel", "channel g is 0 everywhere"),
    "grey": (grey, "channel", "colours lost: the picture is grey"),
    "gamma": (lambda p: codes((p / 255) ** (1 / 1.2)), "gamma", "gamma of the whole picture x 1.20"),
    "brighter": (lambda p: p + 7, "brightness", "every value +7 codes"),
    "bands": (lambda p: codes(np.rint(p / 255 * 15) / 15), "banding", "banding: colours rounded to 4 bits"),
    "empty": (lambda p: np.full_like(p, 33), "empty", "whole picture of one colour: nothing was drawn"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_faults_are_named(name: str, seed: int) -> None:
    fault, kind, text = FAULTS[name]
    true = picture(seed)
    (cause,) = causes(true, np.ascontiguousarray(fault(true)))
    assert (cause.kind, cause.text) == (kind, text)
    assert cause.explained > 0.95
    assert cause.pixels > 0


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), down=st.integers(-6, 6), right=st.integers(-6, 6))
def test_a_shift_is_measured(seed: int, down: int, right: int) -> None:
    whole = picture(seed)
    # Both pictures are parts of a larger one, so that what comes in at the border fits what is there.
    inside = slice(6, -6), slice(6, -6)
    true, shifted = whole[inside], np.roll(whole, (down, right), axis=(0, 1))[inside]
    found = [cause.text for cause in causes(true, shifted)]
    assert found == ([f"whole picture shifted by ({right}, {down})"] if down or right else [])


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), factor=st.floats(0.2, 0.9))
def test_an_exposure_is_measured(seed: int, factor: float) -> None:
    true = (picture(seed) / np.float32(255)).astype(np.float32)
    (cause,) = causes(true, true * np.float32(factor))
    assert (cause.kind, cause.text) == ("exposure", f"exposure x {factor:.2f}")


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (lambda p: np.concatenate([p[..., :3], np.full_like(p[..., 3:], 255)], axis=2), "alpha lost: it is 1 everywhere"),
        (
            lambda p: np.concatenate([np.rint(p[..., :3] / 255 * p[..., 3:]).astype(np.uint8), p[..., 3:]], axis=2),
            "colours multiplied by alpha once too often",
        ),
    ],
)
def test_faults_of_alpha(fault: Callable[[Any], Any], text: str) -> None:
    true = picture(7, 4)
    assert [cause.text for cause in causes(true, fault(true))] == [text]


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_nothing_is_named_where_nothing_explains_the_change(seed: int) -> None:
    true = picture(seed)
    random = np.random.default_rng(seed)
    patched = true.copy()
    patched[5:15, 8:20] = random.integers(0, 255, (10, 12, 3))
    assert causes(true, patched) == ()
    assert causes(true, true) == ()
    assert causes(true, random.integers(0, 255, true.shape).astype(np.uint8)) == ()


def test_values_that_are_not_finite() -> None:
    pixels = np.ones((4, 5, 3), dtype=np.float32)
    pixels[2, 3, 1] = np.inf
    assert not_finite(pixels).text == "1 value is infinite or NaN, the first at x = 3, y = 2"
    pixels[3] = np.nan
    assert not_finite(pixels).text == "16 values are infinite or NaN, the first at x = 3, y = 2"
    assert not_finite(pixels * np.nan).text == "every value is infinite or NaN"
