"""Tracks: their values at the keys and between them, which never go beyond the values of the two nearest keys."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from glshade.scene.animation import Track, at_frame, slopes

KEYS = st.lists(st.integers(-100, 100), min_size=1, max_size=6, unique=True).map(sorted)
KINDS = st.sampled_from(["linear", "smooth", "step"])


@given(frames=KEYS, kind=KINDS, data=st.data(), share=st.floats(-0.2, 1.2))
def test_through_the_keys_and_never_beyond(frames: list[int], kind: Any, data: Any, share: float) -> None:
    values = data.draw(st.lists(st.floats(-10, 10), min_size=len(frames), max_size=len(frames)))
    track = Track(key="a", frames=frames, values=values, interpolation=kind)
    for frame, value in zip(frames, values, strict=True):
        assert track.at(frame) == pytest.approx(value, abs=1e-9)
    t = frames[0] + share * (frames[-1] - frames[0])
    i = int(np.clip(np.searchsorted(frames, t, side="right") - 1, 0, max(len(frames) - 2, 0)))
    around = values[i : i + 2]
    assert min(around) - 1e-9 <= track.at(t) <= max(around) + 1e-9  # type: ignore[operator]


def test_smooth_is_smooth_and_linear_is_straight() -> None:
    straight = Track(key="a", frames=(1, 11), values=(0.0, 10.0))
    assert [straight.at(f) for f in (1, 6, 11)] == pytest.approx([0, 5, 10])
    smooth = Track(key="a", frames=(0, 10, 20), values=((0.0, 1.0), (1.0, 1.0), (4.0, 0.0)), interpolation="smooth")
    t = np.linspace(0, 20, 2001)
    v = np.array([smooth.at(x) for x in t])
    slope = np.gradient(v, t, axis=0)
    # There is no kink: from step to step the slope changes only a little everywhere.
    assert np.abs(np.diff(slope, axis=0)).max() < 0.01
    assert abs(slope[0]).max() < 0.01


@pytest.mark.parametrize("size", [1e-320, 1e-308, 1e-200, 1.0, 1e200])
def test_slopes_of_any_size_have_their_mean(size: float) -> None:
    """Neither 1 / 1e-308 nor 1e-200 * 1e-200 can be held in float64. The harmonic mean of the slopes 1 and 3 is 1.5."""
    found = slopes(np.array([0.0, 1.0, 2.0]), size * np.array([[0.0, 0.0], [1.0, -1.0], [4.0, -4.0]]))
    assert found == pytest.approx(size * np.array([[0, 0], [1.5, -1.5], [0, 0]]), rel=1e-3, abs=0)


def test_the_slope_at_an_extreme_is_zero() -> None:
    values = np.array([[0.0, 1.0, 2.0], [1e-308, 1.0, 1.0], [0.0, 2.0, 3.0]])
    assert not slopes(np.array([0.0, 1.0, 2.0]), values).any()


def test_a_document_at_a_frame() -> None:
    document = {"camera": {"fov": 30}, "objects": [{"name": "ball", "shape": "sphere"}]}
    tracks = [
        Track(key="camera.turn", frames=(1, 101), values=(0, 360)),
        Track(key="objects.ball.transform.translate", frames=(1, 11), values=((0, 0, 0), (0, 10, 0))),
    ]
    result = at_frame(document, tracks, 6)
    assert result["camera"] == {"fov": 30, "turn": pytest.approx(18)}
    assert result["objects"][0]["transform"]["translate"] == pytest.approx([0, 5, 0])
    assert document["camera"] == {"fov": 30}


@pytest.mark.parametrize(
    ("fault", "more"),
    [
        ("as many as frames", {"values": [1]}),
        ("must ascend", {"frames": [2, 1]}),
        ("lists of one length", {"values": [1, [1, 2]]}),
    ],
)
def test_what_is_no_track(fault: str, more: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match=fault):
        Track.model_validate({"key": "a", "frames": [1, 2], "values": [1, 2], **more})
