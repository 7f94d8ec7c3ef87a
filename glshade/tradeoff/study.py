"""Study: draws and times every setting of a scene, and compares the pictures with the float64 reference of the exact setting.

The truth is the reference's picture of the scene at the exact setting: shaded per pixel, with normalised normals and with the
models that the scene names. The total error of a picture is its difference from the truth. To see where the error comes from,
the kinds of knobs are applied one after the other. The error of each kind is the difference between two pictures, one with this
kind and one without it:

    model: the reference draws both pictures.
    sampling: the reference draws both pictures; if it cannot draw the picture with this kind, the GPU draws that one.
    arithmetic: the GPU draws the picture with this kind, stored as float32.
    storage: the GPU draws both pictures.

Pixels at outlines, which a driver may cover or leave out, do not count in any error.
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

from glshade.arrays import unrounded
from glshade.files import replacing
from glshade.image.metrics import METRICS, Errors, errors
from glshade.radiance.readying import ready
from glshade.reference.picture import radiance
from glshade.scene.digest import scene_digest
from glshade.scene.scene import Scene
from glshade.tradeoff.front import Timing, dominated
from glshade.tradeoff.setting import EXACT, Setting, space
from glshade.verification.candidates import surfaces
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[Any]
# The number of settings that are timed in turn, the exact one among them. If the machine slows down, it slows all of them
# alike.
TOGETHER = 8
# The default number of timings of each setting.
REPEAT = 15
# If a film has several samples a pixel, the truth is the mean of SUPERSAMPLES x SUPERSAMPLES samples a pixel.
SUPERSAMPLES = 4


@dataclass(frozen=True)
class Point:
    """The measurements of one setting.

    setting: the setting that was measured.
    timing: the time of a frame.
    vertices: the number of vertices of all meshes.
    total: the errors of the picture.
    by_kind: kind -> the errors that this kind of knobs adds.
    """

    setting: Setting
    timing: Timing
    vertices: int
    total: Errors
    by_kind: dict[str, Errors]

    def error(self, metric: str) -> float:
        """Returns the total error by a metric. It is infinite for a picture with infinities or NaN."""
        return math.inf if self.total.non_finite else float(getattr(self.total, metric))

    def as_dict(self) -> dict[str, Any]:
        """Returns the point in a form that JSON can hold."""
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
        """Returns the point whose `as_dict` gave the data. Errors: KeyError, TypeError, ValueError for other data."""

        def read_errors(values: dict[str, Any]) -> Errors:
            return Errors(**{**values, "at": tuple(values["at"])})

        kinds = {kind: read_errors(values) for kind, values in data["by_kind"].items()}
        timing = Timing(**data["seconds"])
        if not timing.low > 0:
            raise ValueError("a time is not positive")
        return cls(Setting(**data["setting"]), timing, data["vertices"], read_errors(data["total"]), kinds)


@dataclass(frozen=True)
class Study:
    """The measurements of all settings of a scene.

    scene: the scene's name.
    digest: the digest of the scene's contents.
    driver: the names of the OpenGL renderer and version that drew the pictures.
    size: width, height of the pictures [pixels].
    counted: the share of the pixels that count in errors.
    points: the measurements of each setting. The first point is that of the exact setting.
    inert: "knob=value" -> the reason why the value makes no difference and is not measured.
    floor: the errors that rounding the scene's numbers to float32 causes, at every setting.
    """

    scene: str
    digest: str
    driver: str
    size: tuple[int, int]
    counted: float
    points: tuple[Point, ...]
    inert: dict[str, str]
    floor: Errors

    def front(self, metric: str = "max_abs") -> list[int | None]:
        """Returns for each point the index of a point that dominates it by time and metric; None for points on the front."""
        return dominated([p.timing for p in self.points], [p.error(metric) for p in self.points])

    def as_dict(self) -> dict[str, Any]:
        """Returns the study in a form that JSON can hold."""
        fronts = {metric: self.front(metric) for metric in METRICS}
        rows = [
            {**point.as_dict(), "dominated_by": {metric: front[i] for metric, front in fronts.items()}}
            for i, point in enumerate(self.points)
        ]
        head = {"scene": self.scene, "digest": self.digest, "version": __version__, "driver": self.driver, "size": self.size}
        return {**head, "counted": self.counted, "floor": self.floor.as_dict(), "inert": self.inert, "points": rows}


class Pictures:
    """The pictures of H x W pixels that errors are computed from, with a small cache. The scene's own quality is ignored.

    truth: (H, W, 3) float64, the reference's picture at the exact setting [linear].
    certain: (H, W), True for a pixel that counts in errors, because every driver must cover it in the same way.
    """

    def __init__(self, scene: Scene, renderer: Renderer) -> None:
        """Draws the truth. renderer: draws all other pictures."""
        self.scene, self.renderer = scene, renderer
        self.truth = self.exact(EXACT)
        _, self.certain = surfaces(EXACT.applied(scene))
        if scene.film.pictures > 1:
            # Several samples are meant to show outlines well, so pixels at outlines count too.
            self.certain = np.ones_like(self.certain)
        self._exact: dict[Setting, Array] = {EXACT: self.truth}
        self._drawn: dict[Setting, Array] = {}

    def exact(self, setting: Setting) -> Array:
        """Returns the reference's picture (H, W, 3) float64 with a setting's model and sampling [linear]."""
        scene = setting.applied(self.scene)
        if scene.film.pictures == 1:
            return radiance(scene)[..., :3]
        width, height = scene.film.size
        n = SUPERSAMPLES
        crop = scene.film.crop and tuple(n * value for value in scene.film.crop)
        once = {"samples": 1, "supersample": 1}
        large = scene.film.model_copy(update={"size": (width * n, height * n), "crop": crop, **once})
        picture = radiance(scene.model_copy(update={"film": large}))[..., :3]
        *_, width, height = scene.film.window
        result: Array = picture.reshape(height, n, width, n, 3).mean(axis=(1, 3))
        return result

    def drawn(self, setting: Setting) -> Array:
        """Returns the GPU's picture (H, W, 3) float32 at a setting [linear]."""
        if setting not in self._drawn:
            if len(self._drawn) > 4:
                self._drawn.clear()
            image = self.renderer.render(setting.applied(self.scene), dtype="float32")
            self._drawn[setting] = image.pixels[..., :3].copy()
        return self._drawn[setting]

    def errors(self, setting: Setting, flip: bool = True) -> tuple[Errors, dict[str, Errors]]:
        """Returns (total errors, kind -> errors) of a setting. flip: False skips FLIP, which is slow."""
        modelled, sampled = setting.only("model"), setting.only("model", "sampling")
        # The reference cannot leave normals unnormalised, nor place several samples in a pixel as the driver does.
        by_gpu = sampled.normalise is False or (sampled.samples or self.scene.film.samples) * self.scene.film.supersample > 1
        model = self._reference(modelled)
        sampling = self.drawn(replace(sampled, storage="rgba32f")) if by_gpu else self._reference(sampled)
        full, stored = self.drawn(replace(setting, storage="rgba32f")), self.drawn(setting)

        def between(picture: Array, before: Array) -> Errors:
            return errors(picture, before, self.certain, flip)

        kinds = {
            "model": between(model, self.truth),
            "sampling": between(sampling, model),
            "arithmetic": between(full, sampling),
            "storage": between(stored, full),
        }
        return between(stored, self.truth), kinds

    def _reference(self, setting: Setting) -> Array:
        """Returns the same picture as `exact`, from a cache if possible."""
        if setting not in self._exact:
            # A small cache is enough, because `study` orders settings so that those with the same reference follow each other.
            if len(self._exact) > 6:
                self._exact.pop(next(key for key in self._exact if key != EXACT))
            self._exact[setting] = self.exact(setting)
        return self._exact[setting]

    def floor(self) -> Errors:
        """Returns the errors that rounding the scene's numbers to float32 causes in the truth."""
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
    progress: Callable[[str, int, int], None] = lambda setting, done, total: None,
) -> Study:
    """Measures every setting of a scene.

    name: the scene's name in the study.
    knobs: the knobs to vary; empty for all.
    settings: optional, the settings to measure, EXACT among them; by default, all settings of these knobs.
    repeat: the number of timings of each setting.
    kept: optional, the file of the points measured so far. An interrupted study continues from it, if the scene, driver,
        version and `repeat` are the same.
    progress: is called with (the setting in words, number of points done, number of all points) after each setting.
    Errors: SceneError, ShaderError.
    """
    inert: dict[str, str] = {}
    if settings is None:
        settings, inert = space(scene, knobs)
    order = sorted(settings, key=lambda s: (s != EXACT, str(s.only("model")), str(s.only("model", "sampling"))))
    driver = f"{renderer.context.renderer}; {renderer.context.version}"
    head: dict[str, Any] = {"digest": scene_digest(scene), "driver": driver, "version": __version__, "repeat": repeat}
    done = _read(kept, head)
    pictures = Pictures(scene, renderer)
    points = {s: done[s] for s in order if s in done}
    waiting = [s for s in order if s not in points]
    for batch in _batches(waiting, TOGETHER - 1):
        others = [s for s in batch if s != EXACT]
        unit = points[EXACT].timing.median if EXACT in points else None
        times = timed(EXACT.applied(scene), [s.applied(scene) for s in others], renderer, repeat, unit)
        timings = dict(zip((EXACT, *others), times, strict=True))
        for setting in batch:
            total, kinds = pictures.errors(setting)
            vertices = sum(len(i.mesh.positions) for i in ready(setting.applied(scene)).instances)
            points[setting] = Point(setting, timings[setting], vertices, total, kinds)
            progress(str(setting), len(points), len(order))
        _write(kept, head, points)
    counted = float(pictures.certain.mean())
    ordered = tuple(points[s] for s in order)
    return Study(name, head["digest"], driver, scene.film.size, counted, ordered, inert, pictures.floor())


def timed(
    exact: Scene, scenes: Sequence[Scene], renderer: Renderer, repeat: int = REPEAT, unit: float | None = None
) -> list[Timing]:
    """Returns the times of a frame of the exact scene and of other scenes.

    The scenes are drawn in turn. A machine's speed changes from minute to minute. So each time is divided by the median of its
    turn, and the medians of these ratios are scaled to the time of the exact scene. The range of a median over n turns extends
    1.57 IQR / sqrt(n) to either side, where IQR is the interquartile range (McGill, Tukey and Larsen 1978), but not beyond the
    smallest and the largest ratio, so that it never reaches times of zero or less.

    repeat: the number of turns.
    unit: optional, the time of the exact scene [s]; by default, its median over these turns.
    """
    draws = [renderer.drawing(scene) for scene in (exact, *scenes)]
    seconds = np.array([[draw() for draw in draws] for _ in range(repeat)])
    shares = seconds / np.median(seconds, axis=1, keepdims=True)
    middle, low, high = np.quantile(shares, (0.5, 0.25, 0.75), axis=0)
    scale = (float(np.median(seconds[:, 0])) if unit is None else unit) / middle[0]
    reach = 1.57 * (high - low) / repeat**0.5
    least, most = np.maximum(middle - reach, shares.min(axis=0)), np.minimum(middle + reach, shares.max(axis=0))
    return [Timing(*map(float, t * scale)) for t in np.stack([middle, least, most], axis=1)]


def _batches(items: list[Setting], size: int) -> Iterator[list[Setting]]:
    """Yields consecutive parts of a list, each of `size` items at most."""
    for start in range(0, len(items), size):
        yield items[start : start + size]


def _read(path: Path | None, head: dict[str, Any]) -> dict[Setting, Point]:
    """Returns setting -> point from the file of a study; empty if the file is missing, broken or of another study.

    head: the scene, driver, version and number of timings that the file must have.
    """
    if path is None or not path.is_file():
        return {}
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["of"] != head:
            return {}
        points = [Point.from_dict(point) for point in data["points"]]
    except (OSError, ValueError, KeyError, TypeError):
        # A file that cannot be read is replaced later, and its points are measured again.
        return {}
    return {point.setting: point for point in points}


def _write(path: Path | None, head: dict[str, Any], points: dict[Setting, Point]) -> None:
    """Writes the file of a study, as `_read` reads it."""
    if path is None:
        return
    contents = {"of": head, "points": [point.as_dict() for point in points.values()]}
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(contents), encoding="utf-8")
