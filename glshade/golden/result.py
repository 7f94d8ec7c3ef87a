"""Results: the outcome of a comparison of two picture files, with the reason and the sizes of the differences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Outcome(IntEnum):
    """The outcome of a comparison. Its number is the exit code; the numbers are those of OpenImageIO's idiff."""

    SAME = 0
    WARN = 1
    FAIL = 2
    SIZES = 3
    FILE = 4


class SceneVerdict(StrEnum):
    """The verdict on two pictures of a scene, from the values that the float64 reference allows.

    SAME: no pixel differs by more than one 8-bit code.
    FREEDOM: both pictures are right, and more than a code differs only where drivers may differ, such as at outlines.
    BOTH_RIGHT: both pictures are right, but they are pictures of different drivers.
    STALE: only the test picture is right.
    REGRESSION: the test picture is wrong.
    """

    SAME = "same"
    FREEDOM = "same within the driver's freedom"
    BOTH_RIGHT = "changed, both right"
    STALE = "stale baseline"
    REGRESSION = "regression"

    @property
    def outcome(self) -> Outcome:
        """The outcome of two pictures with this verdict."""
        if self is SceneVerdict.REGRESSION:
            return Outcome.FAIL
        return Outcome.WARN if self in (SceneVerdict.BOTH_RIGHT, SceneVerdict.STALE) else Outcome.SAME


# The stage of drawing at which a value goes wrong: which surface covers the pixel, which of several surfaces is in front, its
# light, or the way from the light to the number in the file. It is empty where it is not known.
Stage = Literal["coverage", "depth", "shading", "encode", ""]


@dataclass(frozen=True)
class Cause:
    """A fault that explains why the test picture is wrong, or the place where it is wrong if no known fault explains it.

    kind: the kind of the fault, such as "light" or "flip"; "unknown" where none was found.
    text: the fault in words, such as "light fill x 0.00".
    object: the name of the object in which it shows most; empty where that is not known.
    triangle: the triangle of that object that shows it most; -1 where that is not known.
    stage: the stage of drawing that is at fault.
    explained: the share of the change that the fault explains, from 0 to 1.
    pixels: the number of pixels that show it.
    """

    kind: str
    text: str
    object: str = ""
    triangle: int = -1
    stage: Stage = ""
    explained: float = 0.0
    pixels: int = 0


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

    The error of a pixel is the largest absolute difference of its channels. 8-bit codes count as code / 255. In a layer of
    ids, a pixel with another id has the error 1.

    worst: the largest error.
    rmse: root of the mean squared error.
    p999: the error that 99.9 % of the pixels do not exceed, interpolated between pixels.
    codes: number of channel values whose 8-bit code differs.
    flip: the mean of FLIP over the box of the pixels that differ, from 0 to 1; None where it was not asked for, and for a layer
        that holds no colours.
    """

    worst: float = 0.0
    rmse: float = 0.0
    p999: float = 0.0
    codes: int = 0
    flip: float | None = None


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
    verdict: the verdict by the scene; None where no scene judged.
    causes: the faults that explain a failure, the largest first.
    drivers: the names of the drivers that drew the reference and the test; empty where a file does not tell.
    baseline: the path of the reference picture that was compared.
    distances: name of a variant of the baseline -> root of the mean squared error of the test from it.
    scene: the path of the scene that judged; empty where none did.
    notes: further lines for people.
    seconds: the time that the comparison took [s].
    classes: (H, W, 3) uint8, the classes of the test picture's pixels as colours, for the report's page; None where no scene
        judged, or the pictures are the same.
    """

    name: str
    path: str
    outcome: Outcome
    reason: str = ""
    layers: tuple[LayerResult, ...] = ()
    verdict: SceneVerdict | None = None
    causes: tuple[Cause, ...] = ()
    drivers: tuple[str, str] = ("", "")
    baseline: str = ""
    distances: Mapping[str, float] = field(default_factory=dict)
    scene: str = ""
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    classes: NDArray[np.uint8] | None = field(default=None, repr=False, compare=False)
