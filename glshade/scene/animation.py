"""Animation: values of a scene that change from frame to frame, by dotted keys as `--set` takes them."""

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
    """One value over time. Before the first of its frames it is the first, after the last the last."""

    key: str = Field(
        description='dotted, as --set takes it: "camera.turn", "objects.ball.transform.translate", "lights.key.intensity"'
    )
    frames: Annotated[tuple[Finite, ...], Field(min_length=1)] = Field(description="ascending; fractions are allowed")
    values: tuple[Value, ...] = Field(description="a number, or as many numbers as the value has, for each of the frames")
    interpolation: Literal["linear", "smooth", "step"] = Field(
        "linear", description="smooth: a monotone cubic, which never goes beyond its keys; step: the last key's"
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
        """The value at a frame."""
        times, values = np.array(self.frames), np.array(self.values, dtype=np.float64)
        if self.interpolation == "step" or len(times) == 1:
            found = values[max(int(np.searchsorted(times, frame, side="right")) - 1, 0)]
        else:
            t = float(np.clip(frame, times[0], times[-1]))
            i = min(max(int(np.searchsorted(times, t, side="right")) - 1, 0), len(times) - 2)
            width = times[i + 1] - times[i]
            u = (t - times[i]) / width
            if self.interpolation == "linear":
                found = values[i] * (1 - u) + values[i + 1] * u
            else:
                slope = slopes(times, values)
                found = (
                    (1 + 2 * u) * (1 - u) ** 2 * values[i]
                    + u * (1 - u) ** 2 * width * slope[i]
                    + u * u * (3 - 2 * u) * values[i + 1]
                    + u * u * (u - 1) * width * slope[i + 1]
                )
        result: float | list[float] = found.tolist()
        return result


def slopes(times: Array, values: Array) -> Array:
    """Of a cubic through the keys (K,) and (K, ...) that never goes beyond them: 0 at a key that is an extreme, else the
    weighted harmonic mean of the slopes to either side (Fritsch and Butland 1984); at the ends 0, so that motion eases."""
    steps = np.diff(times)
    shape = (-1, *[1] * (values.ndim - 1))
    width = steps.reshape(shape)
    across = np.diff(values, axis=0) / width
    result = np.zeros_like(values)
    before, after = across[:-1], across[1:]
    one, other = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
    same = before * after > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (one + other) / (one / before + other / after)
    result[1:-1] = np.where(same, mean, 0.0)
    return result


def at_frame(document: Mapping[str, Any], tracks: Iterable[Track], frame: float) -> dict[str, Any]:
    """The document as it is at a frame. Errors: OverrideError for a key that leads nowhere."""
    result = dict(document)
    for track in tracks:
        result = apply(result, track.key, track.at(frame))
    return result
