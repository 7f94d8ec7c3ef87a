"""Page: a study written down: one page that holds it all, its numbers as JSON and CSV, and the front's pictures beside it."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.files import replacing
from glshade.image.image import Image
from glshade.image.metrics import METRICS
from glshade.scene.scene import Scene
from glshade.tradeoff.front import ties
from glshade.tradeoff.setting import KINDS, Setting
from glshade.tradeoff.study import Pictures, Point, Study
from glshade.verification.report import LEAST, RAMP, heat
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[Any]
SAID = {
    "max_abs": "largest error of linear light",
    "rmse": "root mean square of errors of linear light",
    "p999": "error that 99.9 % of the pixels stay within",
    "codes": "8-bit sRGB codes that are others",
    "flip": "mean of FLIP, what the eye notices",
}
# What each kind of error is, for the heads of columns.
KINDS_SAID = {
    "model": "another reflection",
    "sampling": "shaded in fewer places",
    "arithmetic": "float32 and its shortcuts",
    "storage": "digits kept",
}
# Pictures within the page are this wide at most [pixels].
WIDTH = 320
# What a page may weigh [bytes], so that it can be mailed, and what a point without pictures weighs.
PAGE, POINT = 4_500_000, 4_000
# The chart [SVG units]: its size, and what lies around the plot: left, right, top, bottom.
CHART, AROUND = (760.0, 700.0), (66.0, 20.0, 34.0, 48.0)
# Where the slowest takes this many times the fastest's time, times are shown by their logarithm.
WIDE = 8.0
# Bars of errors begin here: below float32's step at 1 nothing is left to see.
FAINTEST = 1e-8


@dataclass(frozen=True)
class Rank:
    """A place on the front. number: from the fastest on, from 1; tie: whether it cannot be told apart from the one before."""

    number: int
    index: int
    tie: bool


def ranks(study: Study, metric: str) -> list[Rank]:
    """The front from the fastest to the slowest; ties share a number."""
    points = study.points
    front = [i for i, by in enumerate(study.front(metric)) if by is None]
    front.sort(key=lambda i: (points[i].timing.median, points[i].error(metric)))
    found: list[Rank] = []
    for i in front:
        before = points[found[-1].index] if found else None
        tie = before is not None and ties(before.timing, points[i].timing) and before.error(metric) == points[i].error(metric)
        found.append(Rank(found[-1].number + (not tie) if found else 1, i, tie))
    return found


def shown(value: float, metric: str = "max_abs") -> str:
    """An error in few letters: 0.0123, 8.2e-6; codes in percent."""
    if not math.isfinite(value):
        return "not finite"
    if metric == "codes":
        # Without an exponent: codes are few or many, and one of ten million pixels is 0.00001 percent.
        return np.format_float_positional(value * 100, 3 if value > 0.1 else 2, fractional=False, trim="-") + "%"
    if value == 0 or value >= 1e-3:
        return f"{value:.3g}"
    digits, _, power = f"{value:.1e}".partition("e")
    return f"{digits.removesuffix('.0')}e{int(power)}"


def milliseconds(seconds: float) -> str:
    """[ms] with three digits: 12.3, 1.23, 0.123."""
    return f"{seconds * 1e3:#.3g}".rstrip(".")


def reason(point: Point, other: Point, metric: str) -> str:
    """Why `other` dominates the point."""
    mine, its = point.error(metric), other.error(metric)
    pace = "as fast" if ties(point.timing, other.timing) else f"{point.timing.median / other.timing.median:.2g} times as fast"
    return f"{pace}, " + ("no less exact" if mine == its else f"{metric} {shown(its, metric)}")


def write(folder: Path, study: Study, scene: Scene, renderer: Renderer, metric: str = "max_abs") -> Path:
    """Writes index.html, tradeoff.json, tradeoff.csv, and pictures/ with the picture and the error map of all that is on a
    front. metric: the one that the page begins with. Returns the page. Errors: GlshadeError."""
    pictures = folder / "pictures"
    try:
        pictures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadeError(f"{error.filename}: cannot be made: {error.strerror}") from None
    _write(folder / "tradeoff.json", json.dumps(study.as_dict(), indent=1, allow_nan=False) + "\n")
    _write(folder / "tradeoff.csv", table(study))
    page = folder / "index.html"
    _write(page, html(study, scene, metric, _pictures(pictures, study, scene, renderer)))
    return page


def table(study: Study) -> str:
    """CSV: one row a setting."""
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
    """The page. pictures: of points by their numbers: JPEG `picture` and `error` in base64, and `file`, its name beside the
    page, each where there is one."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    room = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # The kinds of error stand in the order in which they are told apart.
    room.policies["json.dumps_kwargs"] = {"sort_keys": False}
    fronts = {name: study.front(name) for name in METRICS}
    data = [
        {
            "name": str(p.setting),
            "rate": p.setting.shading,
            "time": [p.timing.median, p.timing.low, p.timing.high],
            "vertices": p.vertices,
            "total": {m: shown(p.error(m), m) for m in METRICS},
            "kinds": {m: {kind: shown(getattr(p.by_kind[kind], m), m) for kind in KINDS} for m in METRICS},
            "bars": {m: {kind: bar(getattr(p.by_kind[kind], m)) for kind in KINDS} for m in METRICS},
            "by": {m: front[i] for m, front in fronts.items()},
            "why": {m: reason(p, study.points[by], m) if (by := front[i]) is not None else None for m, front in fronts.items()},
            **pictures.get(i, {}),
        }
        for i, p in enumerate(study.points)
    ]
    exact = study.points[0]
    return room.get_template("page.html.j2").render(
        study=study,
        description=scene.description,
        version=__version__,
        metric=metric,
        metrics=SAID,
        kinds=KINDS_SAID,
        charts={name: Chart(study, name) for name in METRICS},
        ranks={name: ranks(study, name) for name in METRICS},
        exact=exact,
        data=data,
        shown=shown,
        milliseconds=milliseconds,
        bar=bar,
        floor_text={m: shown(getattr(study.floor, m), m) for m in METRICS},
        floor_bar={m: bar(getattr(study.floor, m)) for m in METRICS},
        ramp=", ".join(f"rgb({int(r)} {int(g)} {int(b)})" for r, g, b in RAMP),
        least=shown(LEAST),
        greatest=shown(_greatest(study)),
    )


def bar(value: float) -> float:
    """How long its bar is [percent]: nothing up to FAINTEST, all of it from 1 on, by the logarithm."""
    if not value > FAINTEST:
        return 0.0
    return round(min(1.0, 1 - math.log(min(value, 1.0)) / math.log(FAINTEST)) * 100, 1)


@dataclass(frozen=True)
class Mark:
    """A point of a chart [SVG units]. low, high: the ends of its range of time. number, tie: its place on the front."""

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
    """Time against the error by one metric, as an SVG has it: what is faster to the left, what is more exact below."""

    study: Study
    metric: str

    @property
    def size(self) -> tuple[float, float]:
        """Width, height."""
        return CHART

    @property
    def plot(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom."""
        left, right, top, bottom = AROUND
        return left, top, CHART[0] - right, CHART[1] - bottom

    @cached_property
    def marks(self) -> list[Mark]:
        """All points: the dominated ones first, which the front then lies over."""
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
        """The front as a path: the error that is to be had within a time falls in steps."""
        places = sorted((m.x, -m.y) for m in self.marks if m.number is not None)
        steps = [f"M{places[0][0]:.1f} {-places[0][1]:.1f}"]
        steps += [f"H{x:.1f}V{-y:.1f}" for x, y in places[1:]]
        return "".join(steps) + f"H{self.plot[2]:.1f}"

    @cached_property
    def _times(self) -> tuple[float, float, bool]:
        """Least, greatest [s], and whether by the logarithm."""
        timings = [p.timing for p in self.study.points]
        low, high = min(t.low for t in timings), max(t.high for t in timings)
        if high > WIDE * low:
            return low / 1.08, high * 1.08, True
        margin = max(high - low, 0.05 * high) * 0.06
        return max(low - margin, 0.0), high + margin, False

    @cached_property
    def _decades(self) -> tuple[int, int]:
        """Powers of ten below and above all errors but zero."""
        some = [e for e in (p.error(self.metric) for p in self.study.points) if e > 0 and math.isfinite(e)] or [1.0]
        low, high = math.floor(math.log10(min(some)) - 0.02), math.ceil(math.log10(max(some)) + 0.02)
        return low, max(high, low + 1)

    @cached_property
    def _lanes(self) -> tuple[bool, bool]:
        """Whether errors of zero, and pictures with values that are not finite, need a place of their own."""
        found = [p.error(self.metric) for p in self.study.points]
        return 0.0 in found, math.inf in found

    def x(self, seconds: float) -> float:
        """Where a time lies."""
        left, _, right, _ = self.plot
        low, high, logarithmic = self._times
        share = math.log(seconds / low) / math.log(high / low) if logarithmic else (seconds - low) / (high - low)
        return round(left + share * (right - left), 1)

    def y(self, error: float) -> float:
        """Where an error lies: zero at the very bottom, what is not finite at the very top."""
        _, top, _, bottom = self.plot
        zero, broken = self._lanes
        highest, lowest = top + 26 * broken, bottom - 26 * zero
        if error == 0 or not math.isfinite(error):
            return bottom - 10 if error == 0 else top + 10
        low, high = self._decades
        return round(lowest - (math.log10(error) - low) / (high - low) * (lowest - highest), 1)

    @property
    def columns(self) -> Iterator[tuple[float, str]]:
        """(x, time [ms]) of the lines that times are read from."""
        low, high, logarithmic = (self._times[0] * 1e3, self._times[1] * 1e3, self._times[2])
        for value in _round_numbers(low, high, logarithmic):
            yield self.x(value / 1e3), f"{value:g}"

    @property
    def rows(self) -> Iterator[tuple[float, str]]:
        """(y, error) of the lines that errors are read from."""
        low, high = self._decades
        every = -(-(high - low) // 8)
        for power in range(low, high + 1, every):
            text = f"{10.0**power:.{max(-power - 2, 0)}%}" if self.metric == "codes" else _power(power)
            yield self.y(10.0**power), text
        zero, broken = self._lanes
        if zero:
            yield self.y(0.0), "0"
        if broken:
            yield self.y(math.inf), "not finite"


def _power(power: int) -> str:
    """10⁻³; what is from 0.01 to 100 plain."""
    if -2 <= power <= 2:
        return f"{10.0**power:g}"
    return "10" + str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _round_numbers(low: float, high: float, logarithmic: bool) -> list[float]:
    """Between them, some eight, that are easily read."""
    if logarithmic:
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        digits = (1, 2, 5) if high > 30 * low else (1, 1.5, 2, 3, 4, 5, 7)
        return [v for p in powers for m in digits if low <= (v := m * 10.0**p) <= high]
    rough = (high - low) / 8
    unit = 10.0 ** math.floor(math.log10(rough))
    step = next(m * unit for m in (1, 2, 5, 10) if m * unit >= rough)
    return [round(i * step, 12) for i in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _greatest(study: Study) -> float:
    """What the error maps go up to, all of them: colours are compared from one to the other."""
    return max([10 * LEAST, *(p.total.max_abs for p in study.points)])


def _pictures(folder: Path, study: Study, scene: Scene, renderer: Renderer) -> dict[int, dict[str, str]]:
    """For each point what the page has of it; those on a front are written into the folder as well."""
    drawn = Pictures(scene, renderer)
    greatest = _greatest(study)
    front = {i for metric in METRICS for i, by in enumerate(study.front(metric)) if by is None}
    found: dict[int, dict[str, str]] = {}
    # Base64 makes four bytes of three.
    room = (PAGE - POINT * len(study.points)) * 3 // 4
    # What is on a front comes first, if there is not room for all.
    for i in sorted(range(len(study.points)), key=lambda i: i not in front):
        setting = study.points[i].setting
        if room <= 0 and i not in front:
            break
        picture = drawn.drawn(setting)
        error = np.abs(picture.astype(np.float64) - drawn.truth).max(axis=2)
        # Outlines are left out of the errors, and so of their map.
        error = np.where(drawn.certain, error, 0.0)
        found[i] = {}
        if i in front:
            name = re.sub(r"[^a-z0-9.]+", "-", str(setting))
            Image(np.ascontiguousarray(picture, dtype=np.float32)).save(folder / f"{name}.png")
            Image(_heat(error, greatest), "srgb").save(folder / f"{name}-error.png")
            found[i]["file"] = name
        if room > 0:
            small = Image(_smaller(picture, np.add)).encoded()
            heated = Image(_heat(_smaller(error, np.maximum), greatest), "srgb")
            found[i] |= {"picture": _jpeg(small), "error": _jpeg(heated)}
            room -= (len(found[i]["picture"]) + len(found[i]["error"])) * 3 // 4
    return found


def _heat(error: Array, greatest: float) -> Array:
    """(H, W, 3) uint8, on the scale of all the maps."""
    # heat() takes the largest error for its scale: a row is put under the map that has it.
    return heat(np.vstack([error, np.full_like(error[:1], greatest)]))[0][:-1]


def _smaller(picture: Array, gather: np.ufunc) -> Array:
    """The picture (H, W, ...) at most WIDTH wide: averages where sums are gathered, else the largest."""
    step = -(-picture.shape[1] // WIDTH)
    if step == 1:
        return picture
    places = [np.arange(0, size, step) for size in picture.shape[:2]]
    result: Array = gather.reduceat(gather.reduceat(picture, places[0], axis=0), places[1], axis=1)
    if gather is np.add:
        rows, columns = (np.diff(np.append(place, size)) for place, size in zip(places, picture.shape, strict=False))
        result = (result / (rows[:, None] * columns)[..., None]).astype(np.float32)
    return result


def _jpeg(image: Image) -> str:
    """Base64 of a JPEG."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.jpg"
        image.save(path)
        return base64.b64encode(path.read_bytes()).decode("ascii")


def _write(path: Path, text: str) -> None:
    try:
        with replacing(path) as beside:
            beside.write_text(text, encoding="utf-8")
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror}") from None
