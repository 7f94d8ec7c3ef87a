"""Page: writes a study as a self-contained HTML page, with its numbers as JSON and CSV and the front's pictures beside it."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.image.image import Image
from glshade.image.metrics import METRICS
from glshade.page import template
from glshade.page.ramp import LEAST, heat
from glshade.page.small import as_base64, smaller
from glshade.scene.scene import Scene
from glshade.tradeoff.front import ties
from glshade.tradeoff.setting import KINDS, Setting
from glshade.tradeoff.study import Pictures, Point, Study

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[Any]
# metric -> its meaning
METRIC_MEANINGS = {
    "max_abs": "largest error of linear light",
    "rmse": "root mean square of errors of linear light",
    "p999": "error that 99.9 % of the pixels do not exceed",
    "codes": "share of 8-bit sRGB codes that differ",
    "flip": "mean of FLIP, an estimate of visible differences",
}
# kind of error -> its meaning, for the headings of columns
KIND_MEANINGS = {
    "model": "approximate reflection",
    "sampling": "shaded in fewer places",
    "arithmetic": "float32, faster forms",
    "storage": "format of the picture",
}
# The largest width and height of the pictures in the page [pixels].
WIDTH = 320
# The largest size of a page, which is small enough for e-mail, and the size of one point without its pictures [bytes].
PAGE, POINT = 4_500_000, 4_000
# The width and height of a chart, and the margins around its plot: left, right, top, bottom [SVG units].
CHART, MARGINS = (760.0, 700.0), (66.0, 20.0, 34.0, 48.0)
# A logarithmic axis has no place for errors of zero and infinity. Each of them has a separate strip of the chart of this height
# [SVG units].
LANE = 26.0
# The axis of times is logarithmic where the slowest time is more than this many times the fastest.
WIDE = 8.0
# The error at which bars have no length. It is smaller than the rounding error of a float32 value near 1.
FAINTEST = 1e-8


@dataclass(frozen=True)
class Rank:
    """The place of a point on the front, when the front is sorted by time.

    number: the place, counted from 1 for the fastest; ties share a number.
    index: the index of the point in the study.
    tie: True if time and error equal those of the place before.
    """

    number: int
    index: int
    tie: bool


def ranks(study: Study, metric: str) -> list[Rank]:
    """Returns the front of a study by a metric, from the fastest point to the slowest."""
    points = study.points
    front = [i for i, by in enumerate(study.front(metric)) if by is None]
    front.sort(key=lambda i: (points[i].timing.median, points[i].error(metric)))
    places: list[Rank] = []
    for i in front:
        before = points[places[-1].index] if places else None
        tie = before is not None and ties(before.timing, points[i].timing) and before.error(metric) == points[i].error(metric)
        number = places[-1].number if places else 0
        places.append(Rank(number if tie else number + 1, i, tie))
    return places


def error_text(value: float, metric: str = "max_abs") -> str:
    """Returns an error as a short text such as 0.0123 or 8.2e-6. Errors by the metric `codes` are in percent."""
    if not math.isfinite(value):
        return "not finite"
    if metric == "codes":
        # Percentages are written without an exponent, however small they are: one pixel of ten million is 0.00001%.
        return np.format_float_positional(value * 100, 3 if value > 0.1 else 2, fractional=False, trim="-") + "%"
    if value == 0 or value >= 1e-3:
        return f"{value:.3g}"
    digits, _, power = f"{value:.1e}".partition("e")
    return f"{digits.removesuffix('.0')}e{int(power)}"


def milliseconds(seconds: float) -> str:
    """Returns a time [s] as a text in milliseconds with three digits, such as 12.3, 1.23 or 0.123."""
    return f"{seconds * 1e3:#.3g}".rstrip(".")


def reason(point: Point, other: Point, metric: str) -> str:
    """Returns the reason why `other` dominates `point`, in words."""
    own_error, other_error = point.error(metric), other.error(metric)
    pace = "as fast" if ties(point.timing, other.timing) else f"{point.timing.median / other.timing.median:.2g} times as fast"
    return f"{pace}, " + ("no less exact" if own_error == other_error else f"{metric} {error_text(other_error, metric)}")


def write(folder: Path, study: Study, scene: Scene, renderer: Renderer, metric: str = "max_abs") -> Path:
    """Writes a study into a folder and returns the path of its index.html.

    The files are index.html, tradeoff.json and tradeoff.csv. The folder pictures/ gets the picture and the error map of each
    point that is on the front by some metric.

    scene: the scene of the study.
    renderer: draws the pictures.
    metric: the metric that the page shows first.
    Errors: GlshadeError where a file cannot be written.
    """
    pictures = folder / "pictures"
    try:
        pictures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadeError(f"{error.filename}: cannot be made: {error.strerror}") from None
    template.write(folder / "tradeoff.json", json.dumps(study.as_dict(), indent=1, allow_nan=False) + "\n")
    template.write(folder / "tradeoff.csv", table(study))
    page = folder / "index.html"
    template.write(page, html(study, scene, metric, _pictures(pictures, study, scene, renderer)))
    return page


def table(study: Study) -> str:
    """Returns a study as CSV, with a row for each setting."""
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    knobs = [f.name for f in fields(Setting)]
    by_kind = [(kind, metric) for kind in KINDS for metric in METRICS]
    head = ["setting", *knobs, "seconds", "low", "high", "vertices", *METRICS, "non_finite"]
    out.writerow([*head, *(f"{kind}_{metric}" for kind, metric in by_kind), *(f"dominated_by_{metric}" for metric in METRICS)])
    fronts = [study.front(metric) for metric in METRICS]
    for i, p in enumerate(study.points):
        choices = [getattr(p.setting, knob) for knob in knobs]
        own = [p.timing.median, p.timing.low, p.timing.high, p.vertices, *(getattr(p.total, m) for m in METRICS)]
        kinds = [getattr(p.by_kind[kind], metric) for kind, metric in by_kind]
        others = [study.points[by].setting if (by := front[i]) is not None else "" for front in fronts]
        out.writerow([p.setting, *("" if c is None else c for c in choices), *own, p.total.non_finite, *kinds, *others])
    return text.getvalue()


def html(study: Study, scene: Scene, metric: str, pictures: dict[int, dict[str, str]]) -> str:
    """Returns the page.

    metric: the metric that the page shows first.
    pictures: index of a point -> its pictures, for points that have some: `picture` and `error` (the error map) are JPEG files
        in base64, and `file` is the name of the PNG file in pictures/ without the suffix.
    """
    fronts = {name: study.front(name) for name in METRICS}
    data = [
        {
            "name": str(p.setting),
            "rate": p.setting.shading,
            "time": [p.timing.median, p.timing.low, p.timing.high],
            "vertices": p.vertices,
            "total": {m: error_text(p.error(m), m) for m in METRICS},
            "kinds": {m: {kind: error_text(getattr(p.by_kind[kind], m), m) for kind in KINDS} for m in METRICS},
            "bars": {m: {kind: bar(getattr(p.by_kind[kind], m)) for kind in KINDS} for m in METRICS},
            "by": {m: front[i] for m, front in fronts.items()},
            "why": {m: reason(p, study.points[by], m) if (by := front[i]) is not None else None for m, front in fronts.items()},
            **pictures.get(i, {}),
        }
        for i, p in enumerate(study.points)
    ]
    exact = study.points[0]
    here = Path(__file__).parent
    return template.render(
        here / "page.html.j2",
        [here / "page.css"],
        [here / "page.js"],
        study=study,
        description=scene.description,
        metric=metric,
        metrics=METRIC_MEANINGS,
        kinds=KIND_MEANINGS,
        charts={name: Chart(study, name) for name in METRICS},
        ranks={name: ranks(study, name) for name in METRICS},
        exact=exact,
        data=data,
        shown=error_text,
        milliseconds=milliseconds,
        bar=bar,
        floor_text={m: error_text(getattr(study.floor, m), m) for m in METRICS},
        floor_bar={m: bar(getattr(study.floor, m)) for m in METRICS},
        least=error_text(LEAST),
        greatest=error_text(_greatest(study)),
    )


def bar(value: float) -> float:
    """Returns the length of an error's bar [percent], on a logarithmic scale: 0 up to FAINTEST, and 100 from 1 on."""
    if not value > FAINTEST:
        return 0.0
    return round(min(1.0, 1 - math.log(min(value, 1.0)) / math.log(FAINTEST)) * 100, 1)


@dataclass(frozen=True)
class Mark:
    """A point in a chart.

    index: the index of the point in the study.
    x, y: its position [SVG units].
    low, high: the ends of the bar that shows the range of its time [SVG units].
    rate: the rate of its setting: phong, gouraud or flat.
    number: its place on the front; None if it is dominated.
    tie: True if time and error equal those of the place before.
    """

    index: int
    x: float
    y: float
    low: float
    high: float
    rate: str
    number: int | None
    tie: bool


@dataclass(frozen=True)
class Chart:
    """The chart of time against error, for an SVG picture: faster points are further left, more exact ones further down.

    study: the study whose points the chart shows.
    metric: the metric by which errors are shown.
    """

    study: Study
    metric: str

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the chart [SVG units]."""
        return CHART

    @property
    def plot(self) -> tuple[float, float, float, float]:
        """The left, top, right and bottom edge of the plot [SVG units]."""
        left, right, top, bottom = MARGINS
        return left, top, CHART[0] - right, CHART[1] - bottom

    @cached_property
    def marks(self) -> list[Mark]:
        """The marks of all points, in drawing order. The front is drawn last, so that it covers the dominated points."""
        places = {rank.index: rank for rank in ranks(self.study, self.metric)}
        marks = []
        for i, p in enumerate(self.study.points):
            x, low, high = (self.x(seconds) for seconds in (p.timing.median, p.timing.low, p.timing.high))
            place = places.get(i)
            front = (place.number, place.tie) if place else (None, False)
            marks.append(Mark(i, x, self.y(p.error(self.metric)), low, high, p.setting.shading, *front))
        return sorted(marks, key=lambda m: (m.number is not None, -(m.number or 0)))

    @property
    def line(self) -> str:
        """The front as an SVG path in steps. At each time it shows the least error of the settings that take no longer."""
        places = sorted((m.x, -m.y) for m in self.marks if m.number is not None)
        steps = [f"M{places[0][0]:.1f} {-places[0][1]:.1f}"]
        steps += [f"H{x:.1f}V{-y:.1f}" for x, y in places[1:]]
        return "".join(steps) + f"H{self.plot[2]:.1f}"

    @cached_property
    def _times(self) -> tuple[float, float, bool]:
        """(least, greatest, logarithmic) of the axis of times: its range [s], and True for a logarithmic axis."""
        timings = [p.timing for p in self.study.points]
        low, high = min(t.low for t in timings), max(t.high for t in timings)
        if high > WIDE * low:
            return low / 1.08, high * 1.08, True
        margin = max(high - low, 0.05 * high) * 0.06
        return max(low - margin, 0.0), high + margin, False

    @cached_property
    def _decades(self) -> tuple[int, int]:
        """(low, high), exponents of ten: all errors that are finite and not zero lie between 10^low and 10^high."""
        positive = [e for e in (p.error(self.metric) for p in self.study.points) if e > 0 and math.isfinite(e)] or [1.0]
        low, high = math.floor(math.log10(min(positive)) - 0.02), math.ceil(math.log10(max(positive)) + 0.02)
        return low, max(high, low + 1)

    @cached_property
    def _lanes(self) -> tuple[bool, bool]:
        """(zero, infinite): whether the chart needs a strip for errors of zero, and one for pictures with infinities or NaN."""
        values = [p.error(self.metric) for p in self.study.points]
        return 0.0 in values, math.inf in values

    def x(self, seconds: float) -> float:
        """Returns the position of a time [SVG units]."""
        left, _, right, _ = self.plot
        low, high, logarithmic = self._times
        share = math.log(seconds / low) / math.log(high / low) if logarithmic else (seconds - low) / (high - low)
        return round(left + share * (right - left), 1)

    def y(self, error: float) -> float:
        """Returns the position of an error [SVG units]. Zero has a strip at the bottom, infinity one at the top."""
        _, top, _, bottom = self.plot
        zero, infinite = self._lanes
        highest, lowest = top + LANE if infinite else top, bottom - LANE if zero else bottom
        if error == 0 or not math.isfinite(error):
            return bottom - 10 if error == 0 else top + 10
        low, high = self._decades
        return round(lowest - (math.log10(error) - low) / (high - low) * (lowest - highest), 1)

    @property
    def columns(self) -> Iterator[tuple[float, str]]:
        """(x [SVG units], text in milliseconds) of each tick of the axis of times."""
        low, high, logarithmic = (self._times[0] * 1e3, self._times[1] * 1e3, self._times[2])
        for value in _round_numbers(low, high, logarithmic):
            yield self.x(value / 1e3), f"{value:g}"

    @property
    def rows(self) -> Iterator[tuple[float, str]]:
        """(y [SVG units], text) of each horizontal line of the chart's grid, from which errors are read."""
        low, high = self._decades
        # There are about eight lines at most.
        step = -(-(high - low) // 8)
        for power in range(low, high + 1, step):
            text = f"{10.0**power:.{max(-power - 2, 0)}%}" if self.metric == "codes" else _power(power)
            yield self.y(10.0**power), text
        zero, infinite = self._lanes
        if zero:
            yield self.y(0.0), "0"
        if infinite:
            yield self.y(math.inf), "not finite"


def _power(power: int) -> str:
    """Returns a power of ten as text, such as 10⁻³; numbers from 0.01 to 100 are written out."""
    if -2 <= power <= 2:
        return f"{10.0**power:g}"
    return "10" + str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _round_numbers(low: float, high: float, logarithmic: bool) -> list[float]:
    """Returns about eight round numbers from low to high."""
    if logarithmic:
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        digits = (1, 2, 5) if high > 30 * low else (1, 1.5, 2, 3, 4, 5, 7)
        return [v for p in powers for m in digits if low <= (v := m * 10.0**p) <= high]
    rough = (high - low) / 8
    unit = 10.0 ** math.floor(math.log10(rough))
    step = next(m * unit for m in (1, 2, 5, 10) if m * unit >= rough)
    return [round(i * step, 12) for i in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _greatest(study: Study) -> float:
    """Returns the greatest error on the scale of the error maps. All maps have the same scale, so that they can be compared."""
    return max([10 * LEAST, *(p.total.max_abs for p in study.points)])


def _pictures(folder: Path, study: Study, scene: Scene, renderer: Renderer) -> dict[int, dict[str, str]]:
    """Draws the pictures of the page and returns them as `html` takes them. Also writes those of the front to a folder."""
    drawn = Pictures(scene, renderer)
    greatest = _greatest(study)
    front = {i for metric in METRICS for i, by in enumerate(study.front(metric)) if by is None}
    embedded: dict[int, dict[str, str]] = {}
    # The number of bytes that are left for pictures. Base64 needs four characters for three bytes.
    room = (PAGE - POINT * len(study.points)) * 3 // 4
    # Points on a front come first, because there may not be room for all points.
    for i in sorted(range(len(study.points)), key=lambda i: i not in front):
        setting = study.points[i].setting
        if room <= 0 and i not in front:
            break
        picture = drawn.drawn(setting)
        error = np.abs(picture.astype(np.float64) - drawn.truth).max(axis=2)
        # Pixels at outlines do not count in the errors, so the map does not show them either.
        error = np.where(drawn.certain, error, 0.0)
        embedded[i] = {}
        if i in front:
            name = re.sub(r"[^a-z0-9.]+", "-", str(setting))
            Image(np.ascontiguousarray(picture, dtype=np.float32)).save(folder / f"{name}.png")
            Image(heat(error, greatest)[0], "srgb").save(folder / f"{name}-error.png")
            embedded[i]["file"] = name
        if room > 0:
            small = Image(smaller(picture, np.add, WIDTH)).encoded()
            heated = heat(smaller(error, np.maximum, WIDTH), greatest)[0]
            embedded[i] |= {"picture": as_base64(small.pixels[..., :3], "jpg"), "error": as_base64(heated, "jpg")}
            room -= (len(embedded[i]["picture"]) + len(embedded[i]["error"])) * 3 // 4
    return embedded
