"""Judges: the tools that judge the pairs of the corpus, one module each, found by its presence. Each is a column of the table.

The module `idiff` holds the class `Idiff`, which derives from Judge.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from glshade.bench.corpus.case import codes_of
from glshade.found import Found
from glshade.image import file as picture_file
from glshade.image.contents import Part

Array = NDArray[Any]


@dataclass(frozen=True)
class Judgement:
    """What a tool says of a pair.

    flagged: whether a comparison with this tool fails, so that a person has to look.
    value: the number by which the tool judges; None where there is none, or where it is infinite or NaN.
    text: what the tool says in words.
    """

    flagged: bool
    value: float | None = None
    text: str = ""


@dataclass(frozen=True)
class Pair:
    """A pair of the corpus with its pixels, each of which is read once for all judges.

    scene: the scene's file.
    reference, test: the files of the pictures.
    """

    scene: Path
    reference: Path
    test: Path

    @cached_property
    def part(self) -> Part:
        """The header of the reference."""
        return picture_file.parts(self.reference)[0]

    @cached_property
    def pixels(self) -> tuple[Array, Array]:
        """The pixels of the reference and of the test as their files hold them, (H, W, 3 or 4) uint8 or float32 each."""
        return picture_file.read_part(self.reference, self.part), picture_file.read_part(
            self.test, picture_file.parts(self.test)[0]
        )

    @cached_property
    def codes(self) -> tuple[Array, Array]:
        """The pixels as 8-bit codes, as a viewer of floats shows them: sRGB-encoded, clipped, and 0 for NaN."""
        reference, test = (_codes(values) for values in self.pixels)
        return reference, test


class Judge:
    """A tool with its settings.

    title: the head of its column.
    threshold: the value above which it flags a pair. None: it is chosen in hindsight, as `table.best_threshold` describes.
    """

    title: ClassVar[str] = ""
    threshold: ClassVar[float | None] = 0.0

    def __init__(self) -> None:
        """Errors: ImportError where the tool is not installed."""

    def judge(self, pair: Pair) -> Judgement:
        """Returns what the tool says of a pair."""
        raise NotImplementedError


def by_value(value: float, threshold: float | None) -> Judgement:
    """Returns the judgement by a number. One that is infinite or NaN is flagged."""
    if not np.isfinite(value):
        return Judgement(True)
    return Judgement(threshold is not None and value > threshold, value)


def _codes(values: Array) -> Array:
    if values.dtype == np.uint8:
        return values
    return np.clip(np.rint(codes_of(np.nan_to_num(values))), 0, 255).astype(np.uint8)


JUDGES: Found[Judge] = Found("glshade.bench.corpus.judges", Path(__file__).parent)
