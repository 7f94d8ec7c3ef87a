"""Budget: the cheapest settings, object by object, whose error stays within limits on views all round; or the most exact
ones within a time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade import reference
from glshade.errors import GlshadeError
from glshade.files import cache_folder, replacing
from glshade.image.metrics import METRICS, Errors, errors, largest
from glshade.image.srgb import linear_to_srgb
from glshade.scene.digest import digest
from glshade.scene.quality import Quality
from glshade.scene.scene import Object, Scene
from glshade.tradeoff.front import Timing
from glshade.tradeoff.setting import EXACT, Setting, space
from glshade.tradeoff.study import timed
from glshade.tradeoff.views import views
from glshade.verification.verification import surfaces
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[Any]
# Views that a choice is tried on. The worst of n is exceeded by one in n + 1 others of the same kind.
VIEWS = 32
# What is asked of the views, as a share of the limit: the worst of them is not the worst of all.
SAFETY = 0.9
# Timings of each setting; what is chosen is timed again, more often.
REPEAT = 5
# Times this near cannot be told apart on a machine that does other things too.
ALIKE = 1.1
# What is hardly faster is not worth an error.
WORTH = 0.97
# Objects that differ most in the picture are chosen for one by one; the rest go together.
GROUPS = 6
# Refining a mesh hangs on the view and takes longer than drawing it, so no budget does it; storage and samples are the film's.
KNOBS = ("fresnel", "specular", "shading", "subdivide", "normalise", "arithmetic")


class BudgetError(GlshadeError):
    """A budget that no setting meets. `least` is what can be reached."""

    exit_code = 2

    def __init__(self, message: str, least: Mapping[str, float]) -> None:
        super().__init__(message)
        self.least = dict(least)


@dataclass(frozen=True)
class Choice:
    """What was chosen. settings: by the objects' numbers. errors: the largest over `views` views. runner_up: the next one, in
    words: its setting, time [s] and errors."""

    settings: tuple[Setting, ...]
    limits: dict[str, float]
    errors: Errors
    seconds: float
    exact_seconds: float
    views: int
    runner_up: str

    def applied(self, scene: Scene) -> Scene:
        """The scene at these settings; its film and storage as they are."""
        return applied(scene, self.settings)

    def says(self, scene: Scene) -> str:
        """For people."""
        names: dict[str, list[str]] = {}
        for number, setting in enumerate(self.settings):
            names.setdefault(_words(setting), []).append(scene.objects[number].name or f"objects[{number}]")
        lines = [
            f"{', '.join(found[:4])}{f' and {len(found) - 4} more' if len(found) > 4 else ''}: {words}"
            for words, found in names.items()
        ]
        for metric, limit in self.limits.items():
            error = getattr(self.errors, metric)
            lines.append(
                f"{metric} {error:.2g} of {limit:g} ({1 - error / limit:.0%} to spare), verified on {self.views} views"
            )
        lines.append(
            f"{self.seconds * 1e3:.2f} ms a frame, {self.exact_seconds / self.seconds:.2f} times as fast as the exact setting "
            f"({self.exact_seconds * 1e3:.2f} ms)"
        )
        return "\n".join([*lines, f"runner-up: {self.runner_up}"] if self.runner_up else lines)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**asdict(self), "settings": [setting.as_dict() for setting in self.settings]}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Choice:
        """What as_dict made."""
        found = Errors(**{**data["errors"], "at": tuple(data["errors"]["at"])})
        return cls(**{**data, "settings": tuple(Setting(**s) for s in data["settings"]), "errors": found})


def parse(texts: Sequence[str]) -> dict[str, float]:
    """`max_abs=2e-3` and the like. Errors: ValueError, said so that a user knows what to write."""
    limits = {}
    for text in texts:
        metric, _, value = text.partition("=")
        if metric not in METRICS:
            raise ValueError(f"{text!r} is not a budget such as max_abs=2e-3; metrics: {', '.join(METRICS)}")
        try:
            limits[metric] = float(value)
        except ValueError:
            raise ValueError(f"{text!r}: {value!r} is not a number") from None
        if not limits[metric] > 0:
            raise ValueError(f"{text!r}: a budget is more than 0")
    return limits


def applied(scene: Scene, settings: Sequence[Setting]) -> Scene:
    """The scene with each object at its own setting."""
    objects = []
    for item, setting in zip(scene.objects, settings, strict=True):
        quality = setting.quality.model_copy(update={"storage": None})
        objects.append(item.model_copy(update={"quality": quality}))
    whole = Quality() if scene.quality.storage is None else Quality(storage=scene.quality.storage)
    return scene.model_copy(update={"objects": tuple(objects), "quality": whole})


def choose(scene: Scene, renderer: Renderer, limits: Mapping[str, float], *, count: int = VIEWS, keep: bool = True) -> Choice:
    """The cheapest settings within the limits (metric -> largest error of linear light, on `count` views).

    Objects are told apart: those of one material and shape are chosen for together. keep: the choice is remembered in the
    user's cache folder by scene, driver and version. Errors: BudgetError with the least that can be reached; SceneError.
    """
    driver = f"{renderer.context.renderer}; {renderer.context.version}"
    place = _place(scene, driver, dict(limits), count) if keep else None
    known = _known(place)
    if known is not None:
        return known
    work = _Work(scene, renderer, count, flip="flip" in limits)
    exact = [EXACT] * len(scene.objects)
    least = work.errors(exact)
    if not within(least, limits, 1.0):
        reached = {metric: getattr(least, metric) for metric in limits}
        said = ", ".join(f"{metric} {limits[metric]:g} (at least {error:.2g})" for metric, error in reached.items())
        raise BudgetError(f"no setting meets the budget on {count} views: {said}", reached)
    uniform = work.uniform()
    candidates = [(setting, timing) for setting, timing in uniform if setting != EXACT and timing.median < work.exact.median]
    share = SAFETY
    chosen, found = exact, least
    while share > 0.2:
        chosen = work.by_group(candidates, {metric: limit * share for metric, limit in limits.items()})
        found = work.errors(chosen)
        if within(found, limits, SAFETY) or chosen == exact:
            break
        share *= 0.8
    if not within(found, limits, SAFETY):
        chosen, found = exact, least
    seconds, exact_seconds = work.time(chosen)
    if seconds > WORTH * exact_seconds:
        chosen, found, seconds = exact, least, exact_seconds
    choice = Choice(
        tuple(chosen), dict(limits), found, seconds, exact_seconds, count, work.runner_up(chosen, uniform, limits, seconds)
    )
    _remember(place, choice)
    return choice


def within_deadline(scene: Scene, renderer: Renderer, seconds: float, *, count: int = VIEWS) -> Choice:
    """The most exact setting, one for all objects, that draws a frame in the time [s]; by max_abs.

    Errors: BudgetError with the least time that can be reached; SceneError.
    """
    work = _Work(scene, renderer, count)
    uniform = work.uniform()
    quick = [(setting, timing) for setting, timing in uniform if timing.median <= seconds]
    if not quick:
        setting, timing = min(uniform, key=lambda pair: pair[1].median)
        raise BudgetError(
            f"no setting draws a frame in {seconds * 1e3:g} ms; the fastest takes {timing.median * 1e3:.2f} ms "
            f"({_words(setting)})",
            {"seconds": timing.median},
        )
    number = len(scene.objects)
    measured = [(work.errors([setting] * number), timing.median, setting) for setting, timing in quick]
    measured.sort(key=lambda row: (row[0].max_abs, row[1]))
    found, time, setting = measured[0]
    rest = (
        f"{_words(measured[1][2])}, {measured[1][1] * 1e3:.2f} ms, max_abs {measured[1][0].max_abs:.2g}" if measured[1:] else ""
    )
    return Choice((setting,) * number, {}, found, time, work.exact.median, count, rest)


def within(found: Errors, limits: Mapping[str, float], share: float) -> bool:
    """Whether all errors are at most that share of their limits, and everything is finite."""
    return found.non_finite == 0 and all(getattr(found, metric) <= limit * share for metric, limit in limits.items())


def _words(setting: Setting) -> str:
    return str(setting).rpartition(", ")[0]


@dataclass(frozen=True, eq=False)
class _View:
    """One view: its truth (H, W, 3), which group each pixel shows (-1: background), and which pixels count."""

    scene: Scene
    truth: Array
    group: Array
    certain: Array


class _Work:
    """What is measured on the way, each thing once."""

    def __init__(self, scene: Scene, renderer: Renderer, count: int, flip: bool = False) -> None:
        self.scene, self.renderer, self.flip = scene, renderer, flip
        self._seen: dict[tuple[Setting, ...], list[Errors]] = {}
        self._shares: dict[Setting, list[dict[int, dict[str, float]]]] = {}
        exact = [EXACT] * len(scene.objects)
        found = []
        for view in views(scene, count):
            there = applied(view, exact)
            number, certain = surfaces(there)
            found.append((view, reference.radiance(there)[..., :3], number, certain))
        pixels = np.zeros(len(scene.objects))
        for _, _, number, _ in found:
            pixels += np.bincount(number[number >= 0], minlength=len(pixels))
        self.groups = _grouped(scene.objects, pixels)
        of = np.append([next(g for g, members in enumerate(self.groups) if i in members) for i in range(len(pixels))], -1)
        self.views = [_View(view, truth, of[number], certain) for view, truth, number, certain in found]
        self.exact = Timing(0.0, 0.0, 0.0)

    def uniform(self) -> list[tuple[Setting, Timing]]:
        """Every setting, of all objects alike, with its time; the fastest first."""
        settings, _ = space(self.scene, KNOBS)
        others = [setting for setting in settings if setting != EXACT]
        number = len(self.scene.objects)
        scene = applied(self.scene, [EXACT] * number)
        found = []
        for start in range(0, len(others), 8):
            batch = others[start : start + 8]
            scenes = [applied(self.scene, [setting] * number) for setting in batch]
            times = timed(scene, scenes, self.renderer, REPEAT, self.exact.median or None)
            self.exact = self.exact if self.exact.median else times[0]
            found += list(zip(batch, times[1:], strict=True))
        if not found:
            self.exact = timed(scene, [], self.renderer)[0]
        return sorted([*found, (EXACT, self.exact)], key=lambda pair: pair[1].median)

    def time(self, settings: Sequence[Setting]) -> tuple[float, float]:
        """(the settings', the exact one's) [s]."""
        exact = applied(self.scene, [EXACT] * len(self.scene.objects))
        one, other = timed(exact, [applied(self.scene, settings)], self.renderer, repeat=15)
        return other.median, one.median

    def errors(self, settings: Sequence[Setting]) -> Errors:
        """The largest over all views."""
        key = tuple(settings)
        if key not in self._seen:
            pairs = ((view, self._drawn(view, settings)) for view in self.views)
            self._seen[key] = [errors(picture, view.truth, view.certain, self.flip) for view, picture in pairs]
        return largest(self._seen[key])

    def by_group(self, candidates: Sequence[tuple[Setting, Timing]], limits: Mapping[str, float]) -> list[Setting]:
        """For each group the fastest that leaves it within its share of every limit: of largest errors the whole limit, of
        averages what is left by the others."""
        chosen: dict[int, Setting] = {}
        for group in range(len(self.groups)):
            fitting: list[tuple[float, Setting]] = []
            fastest = np.inf
            for setting, timing in candidates:
                if timing.median > ALIKE * fastest:
                    break
                if self._fits(group, setting, limits):
                    fastest = min(fastest, timing.median)
                    fitting.append((self._worst(group, setting, limits), setting))
            # Of those that are as fast as can be told, the most exact.
            chosen[group] = min(fitting, key=lambda pair: pair[0])[1] if fitting else EXACT
        result = [EXACT] * len(self.scene.objects)
        for group, members in enumerate(self.groups):
            for member in members:
                result[member] = chosen[group]
        return result

    def _fits(self, group: int, setting: Setting, limits: Mapping[str, float]) -> bool:
        """Looked at view by view: most settings that are too coarse show it early."""
        known = self._shares.setdefault(setting, [])
        for index, view in enumerate(self.views):
            if index == len(known):
                known.append(self._shared(view, self._drawn(view, [setting] * len(self.scene.objects))))
            share = known[index].get(group)
            if share is not None and any(share[metric] > limit for metric, limit in limits.items()):
                return False
        return True

    def _worst(self, group: int, setting: Setting, limits: Mapping[str, float]) -> float:
        """The largest share of any limit on any view, of a setting that fits."""
        found = [view[group] for view in self._shares[setting] if group in view]
        return max((share[metric] / limit for share in found for metric, limit in limits.items()), default=0.0)

    def _shared(self, view: _View, picture: Array) -> dict[int, dict[str, float]]:
        """group -> metric -> its error, as if the whole picture were as that group is."""
        found = {}
        for group in np.unique(view.group[view.group >= 0]):
            there = view.certain & (view.group == group)
            if not there.any():
                continue
            off = np.abs(picture[there] - view.truth[there]).max(axis=1)
            codes = [np.rint(np.clip(linear_to_srgb(p[there].astype(np.float64)), 0, 1) * 255) for p in (picture, view.truth)]
            # An average over the whole picture is less than over the group, and FLIP less than what a pixel may differ by.
            mean = there.sum() / view.certain.sum()
            found[int(group)] = {
                "max_abs": float(off.max()),
                "p999": float(np.quantile(off, 0.999)),
                "rmse": float(np.sqrt(np.mean(off**2))) * mean**0.5,
                "codes": float(np.mean(codes[0] != codes[1])) * mean,
                "flip": 0.0,
            }
        if not np.isfinite(picture).all():
            found = {group: dict.fromkeys(METRICS, np.inf) for group in found}
        return found

    def _drawn(self, view: _View, settings: Sequence[Setting]) -> Array:
        scene = applied(view.scene, settings)
        scene = scene.model_copy(update={"quality": Quality()})
        # A copy: the renderer's own array is used again.
        return self.renderer.render(scene, dtype="float32").pixels[..., :3].copy()

    def runner_up(
        self, chosen: Sequence[Setting], uniform: Sequence[tuple[Setting, Timing]], limits: Mapping[str, float], seconds: float
    ) -> str:
        """The next fastest, of all objects alike, that is within the limits too."""
        for setting, timing in uniform:
            alike = [setting] * len(self.scene.objects)
            if timing.median < seconds or alike == list(chosen):
                continue
            if all(self._fits(group, setting, limits) for group in range(len(self.groups))):
                found = self.errors(alike)
                if within(found, limits, 1.0):
                    said = ", ".join(f"{metric} {getattr(found, metric):.2g}" for metric in limits)
                    return f"{_words(setting)} for all, {timing.median * 1e3:.2f} ms, {said}"
        return ""


def _grouped(objects: Sequence[Object], pixels: Array) -> list[list[int]]:
    """The objects' numbers, those of one material and shape together; small ones beyond GROUPS in one."""
    alike: dict[Any, list[int]] = {}
    for number, item in enumerate(objects):
        material = item.material if isinstance(item.material, str) or item.material is None else item.material.model_dump_json()
        shape = item.shape.model_dump_json() if item.shape else id(item.mesh) if not isinstance(item.mesh, Path) else item.mesh
        alike.setdefault((material, shape, item.normals, str(item.transform.scale)), []).append(number)
    groups = sorted(alike.values(), key=lambda members: -float(pixels[members].sum()))
    rest = [number for members in groups[GROUPS:] for number in members]
    return [*groups[:GROUPS], *([rest] if rest else [])]


def _place(scene: Scene, driver: str, limits: dict[str, float], count: int) -> Path | None:
    key = json.dumps([digest(scene), driver, limits, count, __version__], sort_keys=True)
    return cache_folder("budgets") / f"{hashlib.sha256(key.encode()).hexdigest()}.json"


def _known(path: Path | None) -> Choice | None:
    try:
        return Choice.from_dict(json.loads(path.read_text(encoding="utf-8"))) if path is not None else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _remember(path: Path | None, choice: Choice) -> None:
    if path is None:
        return
    # A cache that cannot be written costs time and nothing else.
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as beside:
            beside.write_text(json.dumps(choice.as_dict()), encoding="utf-8")
