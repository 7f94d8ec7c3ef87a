"""Budget: chooses the fastest settings that keep errors within limits from all viewpoints, or the most exact ones in a time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.files import replacing, user_cache
from glshade.image.metrics import METRICS, Errors, errors, largest
from glshade.image.srgb import linear_to_srgb
from glshade.reference.picture import radiance
from glshade.scene.digest import scene_digest
from glshade.scene.object import Object
from glshade.scene.quality import Quality
from glshade.scene.scene import Scene
from glshade.tradeoff.choice import BudgetError, Choice, applied, simplest, words_of
from glshade.tradeoff.front import Timing
from glshade.tradeoff.setting import EXACT, Setting, space
from glshade.tradeoff.study import timed
from glshade.tradeoff.views import views_around
from glshade.verification.candidates import surfaces
from glshade.version import __version__

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer

Array = NDArray[Any]
# The number of views on which errors are measured. If n views are measured, the error on one more view of the same kind exceeds
# the worst of the n errors with a probability of 1 / (n + 1).
VIEWS = 32
# The errors on these views must stay within this share of the limits, because other views may have larger errors.
SAFETY = 0.9
# The number of timings of each setting. The chosen setting is timed again, more often.
REPEAT = 5
# Times whose ratio is below this count as equal, because other programs on the machine may change a time by as much.
ALIKE = 1.1
# A setting is chosen only if it takes less than this share of the exact setting's time.
WORTH = 0.97
# The groups of objects with the most pixels have a setting of their own. This is the number of these groups. All other objects
# share one setting.
GROUPS = 6
# The knobs that a budget varies. Refined meshes depend on the view and take longer to make than to draw. Storage and samples
# belong to the film.
KNOBS = ("fresnel", "specular", "shading", "subdivide", "normalise", "arithmetic")


def choose(scene: Scene, renderer: Renderer, limits: Mapping[str, float], *, count: int = VIEWS, keep: bool = True) -> Choice:
    """Returns the fastest settings whose errors stay within limits. Objects with the same material and shape share a setting.

    limits: metric -> the largest allowed error of linear light.
    count: the number of views on which the errors are measured.
    keep: True to store the choice in the user's cache folder and, if it is stored already, to return it. It is stored by the
        scene, the limits, the number of views, the driver and glshade's version.
    Errors: SceneError; BudgetError, with the least errors that can be reached.
    """
    driver = f"{renderer.context.renderer}; {renderer.context.version}"
    path = _cache_path(scene, driver, dict(limits), count) if keep else None
    known = _read(path)
    if known is not None:
        return known
    measured = _Measurements(scene, renderer, count, flip="flip" in limits)
    exact = [EXACT] * len(scene.objects)
    least = measured.errors(exact)
    if not within(least, limits, 1.0):
        reached = {metric: getattr(least, metric) for metric in limits}
        words = ", ".join(f"{metric} {limits[metric]:g} (at least {rounded_up(error, 2)})" for metric, error in reached.items())
        raise BudgetError(f"no setting meets the budget on {count} views: {words}", reached)
    uniform = measured.uniform()
    faster = [(setting, timing) for setting, timing in uniform if setting != EXACT and timing.median < measured.exact.median]
    # Some metrics are averages over the picture, to which all groups contribute. So each group's share of the limits shrinks
    # until the groups together stay within the limits.
    share = SAFETY
    chosen, worst = exact, least
    while share > 0.2:
        chosen = measured.by_group(faster, {metric: limit * share for metric, limit in limits.items()})
        worst = measured.errors(chosen)
        if within(worst, limits, SAFETY) or chosen == exact:
            break
        share *= 0.8
    if not within(worst, limits, SAFETY):
        chosen, worst = exact, least
    chosen = simplest(scene, chosen)
    seconds, exact_seconds = measured.time(chosen)
    if seconds > WORTH * exact_seconds:
        chosen, worst, seconds = exact, least, exact_seconds
    runner_up = measured.runner_up(chosen, uniform, limits, seconds / exact_seconds)
    choice = Choice(tuple(chosen), dict(limits), worst, seconds, exact_seconds, count, runner_up)
    _write(path, choice)
    return choice


def within_deadline(scene: Scene, renderer: Renderer, seconds: float, *, count: int = VIEWS) -> Choice:
    """Returns the setting with the smallest max_abs that draws a frame in a given time. All objects share the setting.

    seconds: the largest allowed time of a frame [s].
    count: the number of views on which the errors are measured.
    Errors: SceneError; BudgetError, with the least time that can be reached.
    """
    measured = _Measurements(scene, renderer, count)
    uniform = measured.uniform()
    quick = [(setting, timing) for setting, timing in uniform if timing.median <= seconds]
    if not quick:
        setting, timing = min(uniform, key=lambda pair: pair[1].median)
        raise BudgetError(
            f"no setting draws a frame in {seconds * 1e3:g} ms; the fastest takes {rounded_up(timing.median * 1e3, 3)} ms "
            f"({words_of(setting)})",
            {"seconds": timing.median},
        )
    number = len(scene.objects)
    candidates = [(measured.errors([setting] * number), timing.median, setting) for setting, timing in quick]
    candidates.sort(key=lambda candidate: (candidate[0].max_abs, candidate[1]))
    least, time, setting = candidates[0]
    chosen = simplest(scene, [setting] * number)
    runner_up = ""
    if len(candidates) > 1:
        worst, longer, setting = candidates[1]
        runner_up = f"{words_of(setting)} for all takes {longer / time:.2f} times as long, max_abs {worst.max_abs:.2g}"
    return Choice(tuple(chosen), {}, least, time, measured.exact.median, count, runner_up)


def rounded_up(number: float, digits: int) -> str:
    """Returns a number as text, rounded up, so that a limit of this size is met. digits: the number of significant digits."""
    rounded = Context(prec=digits, rounding=ROUND_CEILING).create_decimal(repr(float(number)))
    return f"{float(rounded):g}"


def within(worst: Errors, limits: Mapping[str, float], share: float) -> bool:
    """Returns whether all values are finite and each error is at most `share` times its limit."""
    return worst.non_finite == 0 and all(getattr(worst, metric) <= limit * share for metric, limit in limits.items())


@dataclass(frozen=True, eq=False)
class _View:
    """A view of H x W pixels.

    scene: the scene from this view.
    truth: (H, W, 3), the reference's picture [linear].
    group: (H, W), the number of the group of objects that each pixel shows; -1 is the background.
    certain: (H, W), True for a pixel that counts in errors, because every driver must cover it in the same way.
    """

    scene: Scene
    truth: Array
    group: Array
    certain: Array


class _Measurements:
    """The times and errors of settings of one scene; each is measured once.

    groups: the numbers of the objects of each group; all objects of a group share a setting.
    views: the views on which errors are measured.
    exact: the time of the exact setting; 0 until `uniform` has measured it.
    """

    def __init__(self, scene: Scene, renderer: Renderer, count: int, flip: bool = False) -> None:
        """Computes the reference's picture of each view. count: the number of views. flip: True to measure FLIP too."""
        self.scene, self.renderer, self.flip = scene, renderer, flip
        # the settings of all objects -> the errors on each view
        self._errors: dict[tuple[Setting, ...], list[Errors]] = {}
        # setting -> a list with an entry for each view that was drawn so far: group -> metric -> error
        self._errors_by_group: dict[Setting, list[dict[int, dict[str, float]]]] = {}
        exact = [EXACT] * len(scene.objects)
        views = []
        for view in views_around(scene, count):
            exact_view = applied(view, exact)
            number, certain = surfaces(exact_view)
            views.append((view, radiance(exact_view)[..., :3], number, certain))
        pixels = np.zeros(len(scene.objects))
        for _, _, number, _ in views:
            pixels += np.bincount(number[number >= 0], minlength=len(pixels))
        self.groups = _grouped(scene.objects, pixels)
        # The group of each object. The last entry is -1 for the background: the background's object number is -1, and as an
        # index -1 selects the last entry.
        group = np.append([next(g for g, members in enumerate(self.groups) if i in members) for i in range(len(pixels))], -1)
        self.views = [_View(view, truth, group[number], certain) for view, truth, number, certain in views]
        self.exact = Timing(0.0, 0.0, 0.0)

    def uniform(self) -> list[tuple[Setting, Timing]]:
        """Returns (setting, time of a frame with all objects at that setting) for every setting, the fastest first."""
        settings, _ = space(self.scene, KNOBS)
        others = [setting for setting in settings if setting != EXACT]
        number = len(self.scene.objects)
        scene = applied(self.scene, [EXACT] * number)
        timings: list[tuple[Setting, Timing]] = []
        # Only a few scenes at a time are drawn in turn. If the machine slows down, it slows all scenes of a batch alike.
        for start in range(0, len(others), 8):
            batch = others[start : start + 8]
            scenes = [applied(self.scene, [setting] * number) for setting in batch]
            times = timed(scene, scenes, self.renderer, REPEAT, self.exact.median or None)
            self.exact = self.exact if self.exact.median else times[0]
            timings += zip(batch, times[1:], strict=True)
        if not timings:
            self.exact = timed(scene, [], self.renderer)[0]
        return sorted([*timings, (EXACT, self.exact)], key=lambda pair: pair[1].median)

    def time(self, settings: Sequence[Setting]) -> tuple[float, float]:
        """Returns (time of a frame at these settings, time of a frame at the exact setting) [s]."""
        exact = applied(self.scene, [EXACT] * len(self.scene.objects))
        exact_timing, timing = timed(exact, [applied(self.scene, settings)], self.renderer, repeat=15)
        return timing.median, exact_timing.median

    def errors(self, settings: Sequence[Setting]) -> Errors:
        """Returns the largest errors over all views. settings: one for each object."""
        key = tuple(settings)
        if key not in self._errors:
            pairs = ((view, self._drawn(view, settings)) for view in self.views)
            self._errors[key] = [errors(picture, view.truth, view.certain, self.flip) for view, picture in pairs]
        return largest(self._errors[key])

    def by_group(self, candidates: Sequence[tuple[Setting, Timing]], limits: Mapping[str, float]) -> list[Setting]:
        """Returns a setting for each object: the fastest that keeps its group within the limits, or the exact one.

        candidates: the settings to choose from with their times, the fastest first.
        limits: metric -> the largest allowed error.
        """
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
            # Of the settings whose times are equal within the noise, the most exact one is chosen.
            chosen[group] = min(fitting, key=lambda pair: pair[0])[1] if fitting else EXACT
        result = [EXACT] * len(self.scene.objects)
        for group, members in enumerate(self.groups):
            for member in members:
                result[member] = chosen[group]
        return result

    def _fits(self, group: int, setting: Setting, limits: Mapping[str, float]) -> bool:
        """Returns whether a setting keeps a group within the limits on every view."""
        # Views are drawn one by one, because most settings that are too coarse fail on an early view.
        known = self._errors_by_group.setdefault(setting, [])
        for index, view in enumerate(self.views):
            if index == len(known):
                known.append(self._group_errors(view, self._drawn(view, [setting] * len(self.scene.objects))))
            group_errors = known[index].get(group)
            if group_errors is not None and any(group_errors[metric] > limit for metric, limit in limits.items()):
                return False
        return True

    def _worst(self, group: int, setting: Setting, limits: Mapping[str, float]) -> float:
        """Returns the largest ratio of a group's error to its limit, for a setting that fits."""
        found = [view[group] for view in self._errors_by_group[setting] if group in view]
        return max((group_errors[metric] / limit for group_errors in found for metric, limit in limits.items()), default=0.0)

    def _group_errors(self, view: _View, picture: Array) -> dict[int, dict[str, float]]:
        """Returns group -> metric -> the error that the group alone causes in the picture (H, W, 3)."""
        found = {}
        for group in np.unique(view.group[view.group >= 0]):
            pixels = view.certain & (view.group == group)
            if not pixels.any():
                continue
            error = np.abs(picture[pixels] - view.truth[pixels]).max(axis=1)
            codes = [np.rint(np.clip(linear_to_srgb(p[pixels].astype(np.float64)), 0, 1) * 255) for p in (picture, view.truth)]
            # Averages over the group are scaled to averages over the whole picture. FLIP depends on neighbouring pixels and is
            # not measured for a group; `errors` measures it for the whole picture.
            share = pixels.sum() / view.certain.sum()
            found[int(group)] = {
                "max_abs": float(error.max()),
                "p999": float(np.quantile(error, 0.999)),
                "rmse": float(np.sqrt(np.mean(error**2))) * share**0.5,
                "codes": float(np.mean(codes[0] != codes[1])) * share,
                "flip": 0.0,
            }
        if not np.isfinite(picture).all():
            found = {group: dict.fromkeys(METRICS, np.inf) for group in found}
        return found

    def _drawn(self, view: _View, settings: Sequence[Setting]) -> Array:
        """Returns the GPU's picture (H, W, 3) float32 of a view [linear]."""
        scene = applied(view.scene, settings)
        scene = scene.model_copy(update={"quality": Quality()})
        # The renderer reuses its array for the next picture, so this one is copied.
        return self.renderer.render(scene, dtype="float32").pixels[..., :3].copy()

    def runner_up(
        self, chosen: Sequence[Setting], uniform: Sequence[tuple[Setting, Timing]], limits: Mapping[str, float], share: float
    ) -> str:
        """Returns a description of the next best choice: the fastest single setting for all objects within the limits.

        The description is empty if no setting is within the limits. Times are compared by their ratios to the exact setting's
        time, because the machine's speed may have changed since `uniform` measured.
        chosen: the setting that was chosen for each object.
        uniform: the settings with their times, as the method `uniform` returns them.
        limits: metric -> the largest allowed error.
        share: the ratio of the chosen settings' time to the exact setting's time; faster settings were rejected already.
        """
        for setting, timing in uniform:
            same = [setting] * len(self.scene.objects)
            ratio = timing.median / self.exact.median / share
            if ratio < 1 or simplest(self.scene, same) == list(chosen):
                continue
            if all(self._fits(group, setting, limits) for group in range(len(self.groups))):
                worst = self.errors(same)
                if within(worst, limits, 1.0):
                    words = ", ".join(f"{metric} {getattr(worst, metric):.2g}" for metric in limits)
                    return f"{words_of(setting)} for all takes {ratio:.2f} times as long, {words}"
        return ""


def _grouped(objects: Sequence[Object], pixels: Array) -> list[list[int]]:
    """Groups the objects by material and shape, and returns the numbers of each group's objects.

    The GROUPS groups with the most pixels come first. All other objects share the last group.
    pixels: (N,), the number of pixels of each object over all views.
    """
    members_of: dict[Any, list[int]] = {}
    for number, item in enumerate(objects):
        material = item.material if isinstance(item.material, str) or item.material is None else item.material.model_dump_json()
        mesh = item.mesh if isinstance(item.mesh, Path) else id(item.mesh)
        shape = item.shape.model_dump_json() if item.shape else mesh
        members_of.setdefault((material, shape, item.normals, str(item.transform.scale)), []).append(number)
    groups = sorted(members_of.values(), key=lambda members: -float(pixels[members].sum()))
    rest = [number for members in groups[GROUPS:] for number in members]
    return [*groups[:GROUPS], rest] if rest else groups[:GROUPS]


def _cache_path(scene: Scene, driver: str, limits: dict[str, float], count: int) -> Path:
    """Returns the file of a choice in the user's cache folder."""
    key = json.dumps([scene_digest(scene), driver, limits, count, __version__], sort_keys=True)
    return user_cache().part("budgets") / f"{hashlib.sha256(key.encode()).hexdigest()}.json"


def _read(path: Path | None) -> Choice | None:
    """Returns the choice in a file; None if there is no file or if it cannot be read."""
    if path is None:
        return None
    try:
        choice = Choice.from_dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    user_cache().used(path)
    return choice


def _write(path: Path | None, choice: Choice) -> None:
    """Writes a choice to its file in the cache."""
    if path is None:
        return
    # Errors are ignored: without a cache the next call is only slower.
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(choice.as_dict()), encoding="utf-8")
        user_cache().added(path)
