"""Wrong place: the place where a picture is most wrong, with the object, the triangles and the stage of drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshade.golden.result import Cause, Stage

if TYPE_CHECKING:
    from glshade.verification.candidates import Candidates
    from glshade.verification.verdict import Verdict

Flags = NDArray[np.bool_]

# The excess of a pixel whose value is not finite, so that it can be compared.
HUGE = 1e6
# A group of wrong pixels reaches at most this far from its worst pixel [pixels].
REACH = 64


def worst_group(verdict: Verdict, candidates: Candidates) -> Cause:
    """Returns the group of neighbouring wrong pixels round the worst one, as a cause without a known fault.

    verdict: the verdict on a picture that has failed.
    candidates: the values that the reference allows.
    """
    excess = np.minimum(np.nan_to_num(verdict.comparison.excess, nan=HUGE, posinf=HUGE), HUGE)
    if not excess.any():
        return Cause("unknown", "; ".join(verdict.reasons))
    width = excess.shape[1]
    y, x = divmod(int(np.argmax(excess)), width)
    inside = _connected(excess > 0, y, x)
    nearest = verdict.comparison.candidate[inside.reshape(-1)]
    draws = np.where(nearest >= 0, candidates.draw[nearest], -1)
    name, triangle = candidates.owner(int(verdict.comparison.candidate[y * width + x]))
    triangles = np.unique(np.stack([draws, candidates.triangle[nearest]])[:, draws >= 0], axis=1).shape[1]
    pixels = int(np.count_nonzero(inside))
    stage = _stage(verdict, inside)
    place = f"{pixels} {'pixel' if pixels == 1 else 'pixels'} round x = {x}, y = {y}"
    surface = f"{name}, {triangles} {'triangle' if triangles == 1 else 'triangles'}" if triangles else name
    return Cause("unknown", f"{stage or 'value'} of {surface}: {place}", name, triangle, stage, pixels=pixels)


def _connected(wrong: Flags, y: int, x: int) -> Flags:
    """Returns the pixels (H, W) that are connected with one wrong pixel by others, diagonally too, within REACH.

    It grows the group step by step, because importing SciPy's functions for pictures takes longer.
    """
    box = (slice(max(y - REACH, 0), y + REACH + 1), slice(max(x - REACH, 0), x + REACH + 1))
    allowed = np.pad(wrong[box], 1)
    group = np.zeros_like(allowed)
    group[y - box[0].start + 1, x - box[1].start + 1] = True
    count = 0
    while count < (count := int(np.count_nonzero(group))):
        rows = group.copy()
        rows[1:] |= group[:-1]
        rows[:-1] |= group[1:]
        group = rows.copy()
        group[:, 1:] |= rows[:, :-1]
        group[:, :-1] |= rows[:, 1:]
        group &= allowed
    result = np.zeros_like(wrong)
    result[box] = group[1:-1, 1:-1]
    return result


def _stage(verdict: Verdict, inside: Flags) -> Stage:
    """Returns the stage at which most of the worst pixels of a group (H, W) went wrong."""
    found = [pixel.origin for pixel in verdict.worst_pixels if inside[pixel.y, pixel.x]]
    stages: list[Stage] = [origin for origin in found if origin != "-" and origin != "not finite"]
    return max(stages, key=stages.count) if stages else ""
