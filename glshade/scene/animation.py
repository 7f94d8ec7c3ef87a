"""Animation: tracks, which give single values of a scene a new value in every frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from glshade.document import Document, Finite
from glshade.scene.override import apply

Array = NDArray[np.float64]
Value = Finite | tuple[Finite, ...]


class Track(Document):
    """One value of the scene over time. Before its first frame it has the first value, after its last frame the last."""

    key: str = Field(description='dotted key of the value, as for --set: "camera.turn", "objects.ball.transform.translate"')
    frames: Annotated[tuple[Finite, ...], Field(min_length=1)] = Field(
        description="frame numbers of the values, ascending; fractions are allowed"
    )
    values: tuple[Value, ...] = Field(description="the value at each of the frames: a number or a list of numbers")
    interpolation: Literal["linear", "smooth", "step"] = Field(
        "linear",
        description="between two frames; smooth: a monotone cubic that stays between their values; step: the earlier value",
    )

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        frames, values = (data.get(name) if isinstance(data, Mapping) else None for name in ("frames", "values"))
        if not isinstance(frames, list | tuple) or not isinstance(values, list | tuple):
            return
        if len(frames) != len(values):
            yield ("values",), f"must be as many as frames: {len(frames)}, not {len(values)}"
        numbers = [x for x in frames if isinstance(x, int | float)]
        if any(later <= earlier for earlier, later in pairwise(numbers)):
            yield ("frames",), "must ascend"
        if len({len(v) if isinstance(v, list | tuple) else 0 for v in values}) > 1:
            yield ("values",), "must all be single numbers, or lists of one length"

    def at(self, frame: float) -> float | list[float]:
        """Returns the value at a frame, which may be a fraction: a number, or a list of numbers where the values are lists."""
        times, values = np.array(self.frames), np.array(self.values, dtype=np.float64)
        if self.interpolation == "step" or len(times) == 1:
            value = values[max(int(np.searchsorted(times, frame, side="right")) - 1, 0)]
        else:
            t = float(np.clip(frame, times[0], times[-1]))
            i = min(max(int(np.searchsorted(times, t, side="right")) - 1, 0), len(times) - 2)
            width = times[i + 1] - times[i]
            u = (t - times[i]) / width
            if self.interpolation == "linear":
                value = values[i] * (1 - u) + values[i + 1] * u
            else:
                # This is the cubic Hermite spline of the two values and of the slopes there.
                slope = slopes(times, values)
                value = (
                    (1 + 2 * u) * (1 - u) ** 2 * values[i]
                    + u * (1 - u) ** 2 * width * slope[i]
                    + u * u * (3 - 2 * u) * values[i + 1]
                    + u * u * (u - 1) * width * slope[i + 1]
                )
        result: float | list[float] = value.tolist()
        return result


def slopes(times: Array, values: Array) -> Array:
    """Returns the slopes (K, ...) at K keys, for a cubic spline that stays between the values of two neighbouring keys.

    A slope is the weighted harmonic mean of the slopes of the straight lines to either side (Fritsch and Butland 1984). It is 0
    at a key whose value is an extreme, and at the first and last key, so that a motion starts and ends gently.
    times: the keys' frames (K,), ascending.
    values: the keys' values (K, ...): single numbers, or arrays of any one shape.
    """
    steps = np.diff(times)
    shape = (-1, *[1] * (values.ndim - 1))
    width = steps.reshape(shape)
    across = np.diff(values, axis=0) / width
    result = np.zeros_like(values)
    before, after = across[:-1], across[1:]
    weight_before, weight_after = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
    # Both slopes are counted in units of the smaller one, because the inverse of a tiny slope would overflow.
    smaller = np.minimum(np.abs(before), np.abs(after))
    with np.errstate(invalid="ignore"):
        inverse = weight_before * (smaller / np.abs(before)) + weight_after * (smaller / np.abs(after))
        mean = np.sign(before) * smaller * ((weight_before + weight_after) / inverse)
    result[1:-1] = np.where(np.sign(before) * np.sign(after) > 0, mean, 0.0)
    return result


def at_frame(document: Mapping[str, Any], tracks: Iterable[Track], frame: float) -> dict[str, Any]:
    """Returns a copy of the document with the values that the tracks have at a frame.

    Errors: OverrideError for a track whose key names no value of the document.
    """
    result = dict(document)
    for track in tracks:
        result = apply(result, track.key, track.at(frame))
    return result
