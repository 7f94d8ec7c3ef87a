"""Verdict: whether a picture is verified, with its worst pixels and the stage of the pipeline at which each went wrong."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.image.image import Image
from glshade.image.srgb import linear_to_srgb, srgb_to_linear
from glshade.reference.bounds import fragment_bounds
from glshade.reference.raster import Fragments, rasterise
from glshade.verification.candidates import Candidates
from glshade.verification.codes import LARGEST, carried
from glshade.verification.judgement import Comparison, PixelClass, judge

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# The stage of the pipeline at which an unexplained value seems to arise; "-" where the value is explained.
Origin = Literal["coverage", "depth", "shading", "encode", "not finite", "-"]


# The default largest share of ambiguous pixels (silhouettes, ties, masked and wide pixels) in a picture that can be verified.
MAX_AMBIGUOUS = 0.03
# The largest share of ambiguous pixels and edges among the pixels that are not background. Without this limit, a tiny object on
# a large background could be verified although all its pixels are ambiguous.
MAX_DOUBTFUL = 0.5
# The number of pixels in the table of the worst ones.
WORST = 12


@dataclass(frozen=True)
class Pixel:
    """One row of the table of the worst pixels. C is the number of the picture's channels.

    Values are in linear light. In an 8-bit picture they are codes divided by 255, with straight alpha.

    x, y: the pixel, counted from the top left.
    object: the name of the object that the nearest candidate belongs to, or "background".
    triangle: the candidate's triangle in that object; -1 for the background.
    kind: the name of the PixelClass in lower case.
    value: (C,), the picture's value.
    low, high: (C,) each, the interval of the nearest candidate.
    error: the distance from the centre of the nearest candidate, in the channel where it is largest.
    used: the ratio of the error to the pixel's tolerance.
    origin: the stage of the pipeline at which an unexplained value seems to arise.
    """

    x: int
    y: int
    object: str
    triangle: int
    kind: str
    value: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    error: float
    used: float
    origin: Origin


@dataclass(frozen=True, eq=False)
class Verdict:
    """The result of a verification.

    verdict: "failed" if some value cannot be right; otherwise "inconclusive" if too many pixels are ambiguous; else "verified".
    reasons: the reasons why the picture is not verified, one sentence for each.
    comparison: the comparison with the reference, pixel by pixel.
    worst_pixels: the worst pixels, the worst one first.
    picture, reference: (H, W, 3 or 4), float32 [linear, premultiplied], or the uint8 codes of an 8-bit picture.
    classes: (H, W), the PixelClass of each pixel.
    driver: the names of the OpenGL renderer and version that drew the picture.
    seconds: name of a step -> the time that it took [s].
    left_out: the settings of the scene that were not judged, each as "name = value"; the picture was drawn without them.
    encoding: the encoding of an 8-bit picture, "srgb" or "linear"; empty for a linear float picture.
    derived: whether the picture was compared with its own GLSL, run in float64, and not with the models' Python functions.
    notes: what else was found, one sentence for each.
    """

    verdict: Literal["verified", "failed", "inconclusive"]
    reasons: tuple[str, ...]
    comparison: Comparison
    worst_pixels: tuple[Pixel, ...]
    picture: Array = field(repr=False)
    reference: Array = field(repr=False)
    classes: Array = field(repr=False)
    driver: str
    seconds: dict[str, float]
    left_out: tuple[str, ...] = ()
    encoding: str = ""
    derived: bool = False
    notes: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The verdict in words: a picture that agrees with its own GLSL alone is never called simply verified."""
        return f"{self.verdict} against its own text" if self.derived else self.verdict

    @property
    def unexplained(self) -> int:
        """The number of pixels that no candidate explains."""
        return self.comparison.unexplained

    @property
    def ambiguous(self) -> float:
        """The share of silhouettes, ties, masked and wide pixels among all pixels."""
        return self.comparison.ambiguous

    @property
    def exit_code(self) -> int:
        """The exit code of the command: 0 verified, 6 failed, 7 inconclusive."""
        return {"verified": 0, "failed": 6, "inconclusive": 7}[self.verdict]

    def __str__(self) -> str:
        c = self.comparison
        counts = ", ".join(f"{number} {kind.name.lower()}" for kind, number in c.counts.items() if number)
        lines = [
            f"{self.words}: {c.unexplained} pixels unexplained, {self.ambiguous:.2%} ambiguous, "
            f"worst interior error {c.worst:.1e} (RMSE {c.rmse:.1e}, p99.9 {c.p999:.1e}; at most {share(self.used)} "
            "of a pixel's tolerance)",
            *self.reasons,
            *self.notes,
            counts,
        ]
        if self.left_out:
            lines.append(f"not judged, and left out of the picture: {', '.join(self.left_out)}")
        return "\n".join(lines)

    @property
    def used(self) -> float:
        """The largest ratio of a pixel's error to its tolerance."""
        return float(self.comparison.used.max(initial=0.0))

    def report(self, folder: Path, title: str = "picture") -> Path:
        """Writes a report into a folder and returns the path of its index.html.

        title: the heading of the report.
        Errors: GlshadeError where the folder or a file cannot be written.
        """
        from glshade.verification.report import Report, write

        c = self.comparison

        def colour(values: tuple[float, ...]) -> str:
            return " ".join(f"{value:.6g}" for value in values)

        facts = {
            "driver": self.driver,
            "unexplained": f"{c.unexplained} pixels",
            "not finite": f"{c.non_finite} values",
            "ambiguous": f"{c.ambiguous:.2%} of the picture, {c.doubtful:.2%} of all but the background",
            "worst error": f"{c.worst:.2e} (interior and seams)",
            "RMSE": f"{c.rmse:.2e}",
            "p99.9": f"{c.p999:.2e}",
            "largest tolerance": f"{c.tolerance:.2e}",
            "most used": f"{share(self.used)} of a pixel's own tolerance",
            "not judged": ", ".join(self.left_out) or "-",
            "compared with": "its own GLSL, run in float64" if self.derived else "the models' Python functions",
            "time": ", ".join(f"{name} {seconds:.2f} s" for name, seconds in self.seconds.items()),
        }
        heads = ("x", "y", "object", "triangle", "class", "value", "lowest", "highest", "error", "used", "arises in")
        rows = [
            [
                str(p.x),
                str(p.y),
                p.object,
                str(p.triangle) if p.triangle >= 0 else "",
                p.kind,
                colour(p.value),
                colour(p.low),
                colour(p.high),
                f"{p.error:.1e}",
                share(p.used),
                p.origin,
            ]
            for p in self.worst_pixels
        ]
        picture, reference = (Image(p, self.encoding or "linear").linear().pixels for p in (self.picture, self.reference))
        return write(
            folder,
            Report(title, self.words, (*self.reasons, *self.notes), picture, reference, c, self.classes, facts, heads, rows),
        )

    def as_dict(self) -> dict[str, Any]:
        """Returns the verdict in a form that JSON can hold, without the pictures."""
        c = self.comparison
        return {
            "verdict": self.words,
            "reasons": list(self.reasons),
            "unexplained": c.unexplained,
            "non_finite": c.non_finite,
            "ambiguous": self.ambiguous,
            "counts": {kind.name.lower(): number for kind, number in c.counts.items()},
            "error": {"worst": c.worst, "rmse": c.rmse, "p99.9": c.p999, "tolerance": c.tolerance},
            "worst_pixels": [vars(pixel) for pixel in self.worst_pixels],
            "driver": self.driver,
            "seconds": self.seconds,
            "left_out": list(self.left_out),
            "derived": self.derived,
            "notes": list(self.notes),
        }


def share(used: float) -> str:
    """Returns a ratio as text: in percent if it is below 10, otherwise as "N times"."""
    return f"{used:.0%}" if used < 10 else f"{used:.3g} times"


def verdict_of(
    picture: Array,
    expected: Candidates,
    mask: Flags | None = None,
    max_ambiguous: float = MAX_AMBIGUOUS,
    made_by: str = "",
    *,
    explain: bool = True,
    max_doubtful: float = MAX_DOUBTFUL,
) -> Verdict:
    """Returns the verdict on a picture.

    picture: (H, W, 3 or 4) [linear, premultiplied], or uint8 codes with straight alpha if the candidates are encoded.
    expected: the values that its pixels may have.
    mask: optional (H, W); True for pixels that are not judged and count as ambiguous.
    max_ambiguous: the largest share of ambiguous pixels in a picture that can be verified.
    made_by: the names of the OpenGL renderer and version that drew the picture.
    explain: True to list the worst pixels, which takes time.
    max_doubtful: the largest share of ambiguous pixels and edges among the pixels that are not background.
    Errors: GlshadeError where the picture has another size than the reference's.
    """
    values = picture / LARGEST if expected.encoding else picture
    comparison = judge(values, expected.expected, mask)
    reasons = []
    if comparison.non_finite:
        reasons.append(f"{comparison.non_finite} value{'s are' if comparison.non_finite > 1 else ' is'} not finite")
    if comparison.unexplained:
        number = comparison.unexplained
        reasons.append(f"{number} pixel{'s are' if number > 1 else ' is'} outside every interval that the reference allows")
    if comparison.empty and not comparison.may_be_empty:
        reasons.append("the picture is empty, although the scene is not")
    verdict: Literal["verified", "failed", "inconclusive"] = "failed" if reasons else "verified"
    if not reasons and comparison.ambiguous > max_ambiguous:
        verdict = "inconclusive"
        reasons.append(f"{comparison.ambiguous:.2%} of the picture is ambiguous, more than {max_ambiguous:.2%}")
    elif not reasons and comparison.doubtful > max_doubtful:
        verdict = "inconclusive"
        reasons.append(
            f"{comparison.doubtful:.0%} of all but the background is ambiguous or an edge, more than {max_doubtful:.0%}"
        )
    channels = picture.shape[2]
    return Verdict(
        verdict,
        tuple(reasons),
        comparison,
        tuple(_worst(values, expected, comparison)) if explain else (),
        picture,
        expected.picture[..., :channels].astype(np.uint8 if expected.encoding else np.float32),
        np.where(mask, PixelClass.MASKED, _map(expected)) if mask is not None else _map(expected),
        made_by or "picture given",
        {},
        encoding=expected.encoding,
        derived=expected.derived,
    )


def _map(expected: Candidates) -> Array:
    """Returns the class of each pixel as an array (H, W)."""
    width, height = expected.expected.size
    return expected.expected.classes.reshape(height, width)


def _worst(picture: Array, expected: Candidates, comparison: Comparison) -> list[Pixel]:
    """Returns the WORST pixels: first unexplained ones, by their excess, then others, by the ratio of error to tolerance."""
    width, _ = expected.expected.size
    excess, used = comparison.excess.reshape(-1), comparison.used.reshape(-1)
    number = min(WORST, len(excess))
    key = np.where(excess > 0, 1e300, used) if not excess.any() else np.where(excess > 0, 10 + excess, 0) + np.minimum(used, 1)
    key = np.nan_to_num(key, posinf=1e308)
    chosen = np.argpartition(-key, number - 1)[:number]
    chosen = chosen[np.argsort(-key[chosen], kind="stable")]
    chosen = chosen[key[chosen] > 0]
    hidden = _hidden(expected, [int(index) for index in chosen if excess[index] > 0])
    channels = picture.shape[2]
    result = []
    for index in chosen:
        nearest = int(comparison.candidate[index])
        owner, triangle = expected.owner(nearest)
        value = picture.reshape(-1, channels)[index]
        low, high = (
            (part[nearest, :channels] if nearest >= 0 else expected.expected.background[:channels])
            for part in (expected.expected.low, expected.expected.high)
        )
        result.append(
            Pixel(
                x=int(index % width),
                y=int(index // width),
                object=owner,
                triangle=triangle,
                kind=PixelClass(int(_map(expected).reshape(-1)[index])).name.lower(),
                value=tuple(map(float, value)),
                low=tuple(map(float, low)),
                high=tuple(map(float, high)),
                error=float(comparison.error.reshape(-1)[index]),
                used=float(used[index]),
                origin=_origin(value, expected, nearest, hidden.get(int(index))) if excess[index] > 0 else "-",
            )
        )
    return result


def _origin(value: Array, expected: Candidates, nearest: int, hidden: tuple[Array, Array] | None) -> Origin:
    """Guesses the stage of the pipeline at which an unexplained value arises.

    value: (C,), the picture's value.
    nearest: the index of the nearest candidate; -1 is the background.
    hidden: optional (low, high), (K, 4) each, the intervals of all K fragments of the pixel, hidden ones included.
    """
    if not np.isfinite(value).all():
        return "not finite"
    channels = len(value)
    background = expected.expected.background[:channels]
    near = max(expected.expected.room, 1e-6 * max(1.0, np.abs(background).max()))
    if nearest < 0 or np.abs(value - background).max() <= near:
        # Either a surface is drawn where only the background can be, or a surface is missing.
        return "coverage"
    if hidden is not None:
        low, high = (end[:, :channels] for end in hidden)
        if ((value >= low) & (value <= high)).all(axis=1).any():
            return "depth"
    # A value counts as wrongly encoded if its distance from the centre, encoded once more or once less, is at most the width of
    # the interval plus one step between 8-bit codes.
    centre = expected.expected.centre[nearest, :3]
    room = (expected.expected.high - expected.expected.low)[nearest, :3].max() + 1 / LARGEST
    others = [linear_to_srgb(centre), *([srgb_to_linear(np.clip(centre, 0, 1))] if expected.encoding else [])]
    return "encode" if any(np.abs(value[:3] - other).max() <= room for other in others) else "shading"


def _hidden(expected: Candidates, pixels: list[int]) -> dict[int, tuple[Array, Array]]:
    """Returns pixel -> (low, high), (K, 4) each, the intervals of all K fragments of the pixel, hidden ones included."""
    if not pixels:
        return {}
    inputs = expected.inputs
    numbers = inputs.wanted.reshape(-1)[pixels]
    # Only the box round these pixels is drawn.
    rows, columns = np.divmod(numbers, inputs.size[0])
    left, top = int(columns.min()), int(rows.min())
    box = replace(inputs, window=(left, top, int(columns.max()) - left + 1, int(rows.max()) - top + 1))
    parts = (part.take(np.isin(part.pixel, numbers)) for part in rasterise(box, expected.driver.margin))
    fragments = Fragments.joined(parts)
    bounds = fragment_bounds(inputs, fragments, expected.driver, fragments.partial)
    low, high = bounds.interval(min(1.0, float(np.abs(bounds.value).max(initial=0.0))))
    if expected.encoding:
        low, high = (
            end + side * expected.expected.room
            for end, side in zip(carried(low, high, None, expected.encoding), (-1, 1), strict=True)
        )
    return {
        pixel: (low[fragments.pixel == number], high[fragments.pixel == number])
        for pixel, number in zip(pixels, numbers, strict=True)
    }
