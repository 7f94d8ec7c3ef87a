"""Results: the outcome of a comparison of two picture files, with the reason and the sizes of the differences."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Outcome(IntEnum):
    """The outcome of a comparison. Its number is the exit code; the numbers are those of OpenImageIO's idiff."""

    SAME = 0
    WARN = 1
    FAIL = 2
    SIZES = 3
    FILE = 4


@dataclass(frozen=True)
class Finding:
    """The judgement of a rule.

    outcome: SAME, WARN or FAIL.
    reason: one sentence that says why; empty for SAME.
    """

    outcome: Outcome
    reason: str = ""


@dataclass(frozen=True)
class Metrics:
    """The sizes of the differences of two layers. They are reported, and no rule judges by them.

    The error of a pixel is the largest absolute difference of its channels. 8-bit codes count as code / 255.

    worst: the largest error.
    rmse: root of the mean squared error.
    p999: the error that 99.9 % of the pixels do not exceed, interpolated between pixels.
    codes: number of channel values whose 8-bit code differs.
    """

    worst: float = 0.0
    rmse: float = 0.0
    p999: float = 0.0
    codes: int = 0


@dataclass(frozen=True)
class LayerResult:
    """The result of one layer of two files.

    name: the layer's name; empty for the picture itself.
    finding: the rule's judgement.
    metrics: the sizes of the differences; None where a value is infinite or NaN.
    """

    name: str
    finding: Finding
    metrics: Metrics | None


@dataclass(frozen=True)
class Result:
    """The result of one pair of files.

    name: the pair's name: the path of the test picture, or its path in its folder.
    path: the path of the test picture, or of the reference where that is the only file.
    outcome: the worst outcome of the layers.
    reason: one line that says why; empty for SAME.
    layers: the results of the layers, in the order of the file; empty where they were not compared.
    """

    name: str
    path: str
    outcome: Outcome
    reason: str = ""
    layers: tuple[LayerResult, ...] = ()
