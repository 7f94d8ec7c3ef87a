"""Study: every setting of a scene drawn, timed and compared with the float64 reference of the exact surface.

The truth is the reference's picture of the scene as it would be at the exact setting: per pixel, normalised, the models as the
scene names them. An error is told apart by taking the choices one kind at a time: those of model alone (two references), then
those of sampling as well (two references), then arithmetic (the driver's float32 picture and the reference), then storage (two
pictures of the driver's). Pixels that a driver may cover or not are left out of all of them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade import reference
from glshade.arrays import unrounded
from glshade.files import replacing
from glshade.image.metrics import METRICS, Errors, errors
from glshade.radiance.readying import ready
from glshade.scene.digest import digest
from glshade.scene.scene import Scene
from glshade.tradeoff.front import Timing, dominated
from glshade.tradeoff.setting import EXACT, Setting, space
from glshade.verification.verification import surfaces
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[Any]
# Settings that are timed in turn, the exact one among them: a machine that slows down slows them all.
TOGETHER = 8
REPEAT = 15
# The reference's picture where a film has several samples: the mean of as many squared.
SUPERSAMPLES = 4


@dataclass(frozen=True)
class Point:
    """One setting, measured. vertices: of the scene's meshes. by_kind: what each kind of choice adds; total: all together."""

    setting: Setting
    timing: Timing
    vertices: int
    total: Errors
    by_kind: dict[str, Errors]

    def error(self, metric: str) -> float:
        """In all; infinite where the picture has values that are not finite, which a metric leaves out."""
        return math.inf if self.total.non_finite else float(getattr(self.total, metric))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "setting": self.setting.as_dict(),
            "name": str(self.setting),
            "seconds": vars(self.timing),
            "vertices": self.vertices,
            "total": self.total.as_dict(),
            "by_kind": {kind: found.as_dict() for kind, found in self.by_kind.items()},
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Point:
        """What as_dict made."""

        def found(of: dict[str, Any]) -> Errors:
            return Errors(**{**of, "at": tuple(of["at"])})

        kinds = {kind: found(of) for kind, of in data["by_kind"].items()}
        timing = Timing(**data["seconds"])
        return cls(Setting(**data["setting"]), timing, data["vertices"], found(data["total"]), kinds)


@dataclass(frozen=True)
class Study:
    """All points of a scene. inert: choices that change nothing, and how that is known. floor: what rounding the inputs to
    float32 costs, which no setting can undo."""

    scene: str
    digest: str
    driver: str
    size: tuple[int, int]
    counted: float
    points: tuple[Point, ...]
    inert: dict[str, str]
    floor: Errors

    def front(self, metric: str = "max_abs") -> list[int | None]:
        """For each point the number of the one that dominates it, by time and metric; None on the front."""
        return dominated([p.timing for p in self.points], [p.error(metric) for p in self.points])

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        fronts = {metric: self.front(metric) for metric in METRICS}
        rows = [
            {**point.as_dict(), "dominated_by": {metric: front[i] for metric, front in fronts.items()}}
            for i, point in enumerate(self.points)
        ]
        head = {"scene": self.scene, "digest": self.digest, "version": __version__, "driver": self.driver, "size": self.size}
        return {**head, "counted": self.counted, "floor": self.floor.as_dict(), "inert": self.inert, "points": rows}


class Pictures:
    """The pictures that errors are made from, each drawn once. scene: without quality of its own mattering."""

    def __init__(self, scene: Scene, renderer: Renderer) -> None:
        self.scene, self.renderer = scene, renderer
        self.truth = self.exact(EXACT)
        _, self.certain = surfaces(EXACT.applied(scene))
        if scene.film.pictures > 1:
            # Edges are what several samples are for: nothing is left out.
            self.certain = np.ones_like(self.certain)
        self._exact: dict[Setting, Array] = {EXACT: self.truth}
        self._drawn: dict[Setting, Array] = {}

    def exact(self, setting: Setting) -> Array:
        """(H, W, 3) float64: the reference's, of the setting's model and sampling."""
        scene = setting.applied(self.scene)
        if scene.film.pictures == 1:
            return reference.radiance(scene)[..., :3]
        width, height = scene.film.size
        n = SUPERSAMPLES
        crop = scene.film.crop and tuple(n * value for value in scene.film.crop)
        once = {"samples": 1, "supersample": 1}
        large = scene.film.model_copy(update={"size": (width * n, height * n), "crop": crop, **once})
        picture = reference.radiance(scene.model_copy(update={"film": large}))[..., :3]
        *_, width, height = scene.film.window
        result: Array = picture.reshape(height, n, width, n, 3).mean(axis=(1, 3))
        return result

    def drawn(self, setting: Setting) -> Array:
        """(H, W, 3) float32: the driver's."""
        if setting not in self._drawn:
            if len(self._drawn) > 4:
                self._drawn.clear()
            image = self.renderer.render(setting.applied(self.scene), dtype="float32")
            self._drawn[setting] = image.pixels[..., :3].copy()
        return self._drawn[setting]

    def errors(self, setting: Setting, flip: bool = True) -> tuple[Errors, dict[str, Errors]]:
        """(in all, by kind)."""
        modelled, sampled = setting.only("model"), setting.only("model", "sampling")
        # The reference has normals of length one, and samples of its own choosing.
        by_driver = sampled.normalise is False or (sampled.samples or self.scene.film.samples) * self.scene.film.supersample > 1
        model = self._reference(modelled)
        sampling = self.drawn(replace(sampled, storage="rgba32f")) if by_driver else self._reference(sampled)
        full, stored = self.drawn(replace(setting, storage="rgba32f")), self.drawn(setting)

        def between(one: Array, other: Array) -> Errors:
            return errors(one, other, self.certain, flip)

        kinds = {
            "model": between(model, self.truth),
            "sampling": between(sampling, model),
            "arithmetic": between(full, sampling),
            "storage": between(stored, full),
        }
        return between(stored, self.truth), kinds

    def _reference(self, setting: Setting) -> Array:
        if setting not in self._exact:
            # The settings come in an order in which those that share a reference are near one another.
            if len(self._exact) > 6:
                self._exact.pop(next(key for key in self._exact if key != EXACT))
            self._exact[setting] = self.exact(setting)
        return self._exact[setting]

    def floor(self) -> Errors:
        """What rounding the inputs costs: the truth beside the same from inputs in float64."""
        with unrounded():
            return errors(self.exact(EXACT), self.truth, self.certain)


def study(
    scene: Scene,
    renderer: Renderer,
    *,
    name: str = "scene",
    knobs: tuple[str, ...] = (),
    settings: Sequence[Setting] | None = None,
    repeat: int = REPEAT,
    kept: Path | None = None,
    progress: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> Study:
    """Measures every setting. knobs: the ones to turn, all where it is empty. settings: these, in place of the whole space.

    repeat: timings of each, taken in turn. kept: a file that holds what is done, and is taken up where it was left, if it is of
    the same scene, driver and version. progress(what, done, total). Errors: SceneError, ShaderError.
    """
    inert: dict[str, str] = {}
    if settings is None:
        settings, inert = space(scene, knobs)
    order = sorted(settings, key=lambda s: (s != EXACT, str(s.only("model")), str(s.only("model", "sampling"))))
    driver = f"{renderer.context.renderer}; {renderer.context.version}"
    head: dict[str, Any] = {"digest": digest(scene), "driver": driver, "version": __version__, "repeat": repeat}
    done = _taken_up(kept, head)
    pictures = Pictures(scene, renderer)
    found: dict[Setting, Point] = {s: done[s] for s in order if s in done}
    waiting = [s for s in order if s not in found]
    for batch in _batches(waiting, TOGETHER - 1):
        others = [s for s in batch if s != EXACT]
        unit = found[EXACT].timing.median if EXACT in found else None
        times = timed(EXACT.applied(scene), [s.applied(scene) for s in others], renderer, repeat, unit)
        timings = dict(zip((EXACT, *others), times, strict=True))
        for setting in batch:
            total, kinds = pictures.errors(setting)
            vertices = sum(len(i.mesh.positions) for i in ready(setting.applied(scene)).instances)
            found[setting] = Point(setting, timings[setting], vertices, total, kinds)
            progress(str(setting), len(found), len(order))
        _keep(kept, head, found)
    points = tuple(found[s] for s in order)
    counted = float(pictures.certain.mean())
    return Study(name, head["digest"], driver, scene.film.size, counted, points, inert, pictures.floor())


def timed(
    exact: Scene, scenes: Sequence[Scene], renderer: Renderer, repeat: int = REPEAT, unit: float | None = None
) -> list[Timing]:
    """The exact scene's time, then the others', drawn in turn, `repeat` times.

    A machine changes its pace from minute to minute: what is taken is the ratio to the median of the same turn, on a scale
    where the exact scene takes what it takes (or `unit` [s], where that is known already). A median's range is 1.57 quartile
    distances over the root of their number to either side (McGill, Tukey and Larsen 1978).
    """
    draws = [renderer.drawing(scene) for scene in (exact, *scenes)]
    seconds = np.array([[draw() for draw in draws] for _ in range(repeat)])
    shares = seconds / np.median(seconds, axis=1, keepdims=True)
    middle, low, high = np.quantile(shares, (0.5, 0.25, 0.75), axis=0)
    scale = (float(np.median(seconds[:, 0])) if unit is None else unit) / middle[0]
    reach = 1.57 * (high - low) / repeat**0.5
    return [Timing(*map(float, t * scale)) for t in np.stack([middle, middle - reach, middle + reach], axis=1)]


def _batches(items: list[Setting], size: int) -> Iterator[list[Setting]]:
    for start in range(0, len(items), size):
        yield items[start : start + size]


def _taken_up(path: Path | None, head: dict[str, Any]) -> dict[Setting, Point]:
    if path is None or not path.is_file():
        return {}
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["of"] != head:
            return {}
        points = [Point.from_dict(point) for point in data["points"]]
    except (OSError, ValueError, KeyError, TypeError):
        # Not worth more than doing it again.
        return {}
    return {point.setting: point for point in points}


def _keep(path: Path | None, head: dict[str, Any], found: dict[Setting, Point]) -> None:
    if path is None:
        return
    with replacing(path) as beside:
        beside.write_text(json.dumps({"of": head, "points": [point.as_dict() for point in found.values()]}), encoding="utf-8")
