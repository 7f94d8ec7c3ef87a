"""A volume is read with trilinear filtering, as OpenGL 4.6 core defines it in section 8.14.2."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.textures.volume import End, Volume

ENDS = st.tuples(*[st.sampled_from(["clamp", "repeat"])] * 3)


@st.composite
def volumes(draw: st.DrawFn) -> Volume:
    """Draws a small table of random colours."""
    size = draw(st.tuples(*[st.integers(1, 4)] * 3))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    ends: Any = draw(ENDS)
    return Volume(random.uniform(-10, 10, (*size, 3)).astype(np.float16), ends, "random")


def middles(volume: Volume) -> np.ndarray[Any, Any]:
    """Returns the texture coordinates (D, H, W, 3) of the middles of the texels."""
    x, y, z = ((np.arange(count) + 0.5) / count for count in volume.size)
    return np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1)


@given(volumes())
def test_the_middle_of_a_texel_shows_the_texel(volume: Volume) -> None:
    assert volume.sample(middles(volume)) == pytest.approx(volume.texels.astype(np.float64), abs=1e-12)


@given(volumes(), st.integers(0, 2**32 - 1))
def test_between_two_texels_values_are_linear(volume: Volume, seed: int) -> None:
    """Within a cell, the values on a line along an axis are those of a straight line, and none leaves the texels' range."""
    random = np.random.default_rng(seed)
    cell = random.integers(-1, np.array(volume.size)) + 0.5
    for axis in range(3):
        place = cell + random.uniform(0, 1, 3)
        line = np.tile(place, (3, 1))
        line[:, axis] = cell[axis] + np.array([0.0, 0.25, 1.0])
        first, between, last = volume.sample(line / volume.size)
        assert between == pytest.approx(0.75 * first + 0.25 * last, abs=1e-9)
        low, high = (f(volume.texels.astype(np.float64), axis=(0, 1, 2)) for f in (np.min, np.max))
        assert np.all((first >= low - 1e-9) & (first <= high + 1e-9))


@given(volumes(), st.tuples(*[st.floats(-3, 3)] * 3))
def test_ends(volume: Volume, at: tuple[float, float, float]) -> None:
    """A repeating axis has the period 1. Beyond the ends of a clamped axis, the last texel stays."""
    place = np.array(at)
    inside = place.copy()
    for axis, (end, count) in enumerate(zip(volume.ends, volume.size, strict=True)):
        inside[axis] = place[axis] % 1 if end == "repeat" else np.clip(place[axis], 0.5 / count, 1 - 0.5 / count)
    assert volume.sample(place) == pytest.approx(volume.sample(inside), abs=1e-6)


@pytest.mark.parametrize("axis", range(3))
def test_a_shift_moves_the_places_by_texels(axis: int) -> None:
    random = np.random.default_rng(1)
    ends: tuple[End, End, End] = ("clamp", "repeat", "clamp")
    volume = Volume(random.uniform(-1, 1, (4, 3, 5, 3)).astype(np.float16), ends, "random")
    shift = [0.0, 0.0, 0.0]
    shift[axis] = 0.3
    at = random.uniform(0, 1, (50, 3))
    moved = at + 0.3 * (np.arange(3) == axis) / np.array(volume.size)
    found = replace(volume, shift=(shift[0], shift[1], shift[2])).sample(at)
    assert found == pytest.approx(volume.sample(moved), abs=1e-12)
    assert np.abs(found - volume.sample(at)).max() > 0.05


def test_the_result_has_the_type_of_the_coordinates() -> None:
    volume = Volume.constant(0.5)
    for dtype in (np.float32, np.float64):
        found = volume.sample(np.zeros((2, 4, 3), dtype))
        assert found.dtype == dtype
        assert found.shape == (2, 4, 3)
        assert np.all(found == 0.5)
