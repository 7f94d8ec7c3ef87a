"""pixelmatch: the Python port of mapbox's pixelmatch with its defaults: threshold 0.1, and no anti-aliased pixels."""

from __future__ import annotations

import numpy as np

from glshade.bench.corpus.judges import Array, Judge, Judgement, Pair


class Pixelmatch(Judge):
    """pixelmatch, which flags a pair if a pixel differs. Its threshold is the default of the library."""

    title = "pixelmatch 0.1"

    def __init__(self) -> None:
        from pixelmatch import pixelmatch

        self._count = pixelmatch

    def judge(self, pair: Pair) -> Judgement:
        # The first pixel that differs decides, and the library is slow.
        count = self.count(*pair.codes, fail_fast=True)
        return Judgement(count > 0, float(count))

    def count(self, reference: Array, test: Array, threshold: float = 0.1, fail_fast: bool = False) -> int:
        """Returns the number of pixels that differ, for codes (H, W, 3 or 4); at most 1 if `fail_fast` is True."""
        height, width = reference.shape[:2]
        # The library is pure Python, and its sums would overflow with NumPy's 8-bit integers; bytes give Python's.
        first, second = (_with_alpha(codes).tobytes() for codes in (reference, test))
        return int(self._count(first, second, width, height, threshold=threshold, fail_fast=fail_fast))


def _with_alpha(codes: Array) -> Array:
    """Returns codes (H, W, 4) for codes with or without alpha."""
    if codes.shape[2] == 4:
        return codes
    return np.concatenate([codes, np.full_like(codes[..., :1], 255)], axis=2)
