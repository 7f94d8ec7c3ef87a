"""codes: values may differ by one 8-bit code, and a few pixels may take the value of a neighbour."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.pair import Pair, encoded, merged
from glshade.golden.result import Finding, Outcome
from glshade.golden.rules import Rule
from glshade.golden.rules.exact import Exact

Array = NDArray[Any]

# Two drivers may decide differently which triangle covers a pixel's centre. So this many pixels, or this share of all pixels if
# that is more, may show the value of a neighbour.
MOST_MOVED, SHARE_MOVED = 4, 0.0005


class Codes(Rule):
    """8-bit codes may differ by 1; floats are encoded first, and above 1 they may differ by 1/255 of the value.

    A pixel may differ by more where each picture holds, in the 3x3 pixels around it, the value that the other picture has at
    the pixel. At most the larger of 4 pixels and 0.05 % of all pixels may do so. A layer of ids must be equal.
    """

    def judge(self, pair: Pair) -> Finding:
        if pair.holds_ids:
            return _judge_ids(pair)
        reference, test = pair.changed_values
        far = ~close(reference, test, pair.channels)
        count = int(np.count_nonzero(far))
        if count == 0:
            return Finding(Outcome.SAME)
        allowed = max(MOST_MOVED, int(SHARE_MOVED * pair.size))
        if count > allowed:
            pixels = "pixel differs" if count == 1 else "pixels differ"
            return Finding(Outcome.FAIL, f"{count} {pixels} by more than 1 code, and at most {allowed} may")
        places = np.argwhere(pair.changed)[far]
        alien = ~(_around(pair.reference, places, test[far], pair) & _around(pair.test, places, reference[far], pair))
        if not alien.any():
            return Finding(Outcome.SAME)
        y, x = places[np.argmax(alien)]
        return Finding(
            Outcome.FAIL,
            f"{np.count_nonzero(alien)} of the pixels that differ by more than 1 code have a value that no neighbour has in "
            f"the other picture; the first is x = {x}, y = {y}",
        )


def _judge_ids(pair: Pair) -> Finding:
    """Returns the judgement of two layers of ids. Two ids that differ could become the same 8-bit code."""
    finding = Exact().judge(pair)
    return Finding(finding.outcome, f"{finding.reason}; these are ids, which must be equal") if pair.count else finding


def close(a: Array, b: Array, channels: tuple[str, ...]) -> NDArray[np.bool_]:
    """Returns which pixels differ by at most one code in every channel.

    a, b: (..., C) uint8 or finite float32, with the names of the C channels.
    """
    near: Array = np.abs(encoded(a, channels).astype(np.int16) - encoded(b, channels)) <= 1
    if a.dtype != np.uint8 or b.dtype != np.uint8:
        first, second = (values.astype(np.float64) / (255 if values.dtype == np.uint8 else 1) for values in (a, b))
        # Codes end at 1, in both directions. Of larger values, the part beyond 1 is compared.
        beyond = np.abs((first - np.clip(first, -1, 1)) - (second - np.clip(second, -1, 1)))
        near = near & (beyond <= np.maximum(np.abs(first), np.abs(second)) / 255)
    return merged(np.logical_and, (near[..., c] for c in range(len(channels))))


def _around(picture: Array, places: Array, values: Array, pair: Pair) -> NDArray[np.bool_]:
    """Returns for which of K places one of the 3x3 pixels around it has, to one code, the place's value.

    picture: (H, W, C). places: (K, 2), rows and columns. values: (K, C).
    """
    height, width = picture.shape[:2]
    found = np.zeros(len(places), dtype=np.bool_)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            # At the border of the picture, the nearest pixel stands for one beyond it.
            rows = np.clip(places[:, 0] + down, 0, height - 1)
            columns = np.clip(places[:, 1] + right, 0, width - 1)
            found |= close(picture[rows, columns], values, pair.channels)
    return found
