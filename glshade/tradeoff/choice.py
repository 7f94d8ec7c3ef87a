"""Choice: the settings that were chosen for the objects of a scene within a budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from glshade.errors import GlshadeError
from glshade.image.metrics import METRICS, Errors
from glshade.scene.quality import Quality
from glshade.scene.scene import Scene
from glshade.tradeoff.setting import EXACT, Setting, drawn_from


class BudgetError(GlshadeError):
    """The exception that is raised if no setting meets a budget.

    least: metric -> the least error that can be reached; or "seconds" -> the least time of a frame [s].
    """

    exit_code = 2

    def __init__(self, message: str, least: Mapping[str, float]) -> None:
        super().__init__(message)
        self.least = dict(least)


@dataclass(frozen=True)
class Choice:
    """The settings that were chosen for the N objects of a scene.

    settings: N settings, in the order of the scene's objects.
    limits: metric -> the largest error that the budget allows.
    errors: the largest errors over all views.
    seconds: the time of a frame [s].
    exact_seconds: the time of a frame at the exact setting [s].
    views: the number of views on which the errors were measured.
    runner_up: the next best setting in words, with the ratio of its time to the chosen settings' time, and its errors; empty if
        no other setting is within the budget.
    """

    settings: tuple[Setting, ...]
    limits: dict[str, float]
    errors: Errors
    seconds: float
    exact_seconds: float
    views: int
    runner_up: str

    def applied(self, scene: Scene) -> Scene:
        """Returns the scene with these settings; its film and storage do not change."""
        return applied(scene, self.settings)

    def summary(self, scene: Scene) -> str:
        """Returns the choice in words, a line for each setting, limit and time."""
        names: dict[str, list[str]] = {}
        for number, setting in enumerate(self.settings):
            names.setdefault(words_of(setting), []).append(scene.objects[number].name or f"objects[{number}]")
        lines = [
            f"{', '.join(objects[:4])}{f' and {len(objects) - 4} more' if len(objects) > 4 else ''}: {words}"
            for words, objects in names.items()
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
        if self.runner_up:
            lines.append(f"runner-up: {self.runner_up}")
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        """Returns the choice in a form that JSON can hold."""
        return {**asdict(self), "settings": [setting.as_dict() for setting in self.settings]}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Choice:
        """Returns the choice whose `as_dict` gave the data. Errors: KeyError, TypeError for other data."""
        read_errors = Errors(**{**data["errors"], "at": tuple(data["errors"]["at"])})
        return cls(**{**data, "settings": tuple(Setting(**s) for s in data["settings"]), "errors": read_errors})


def parse(texts: Sequence[str]) -> dict[str, float]:
    """Returns metric -> limit from texts such as `max_abs=2e-3`. Errors: ValueError, with an example for the user."""
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
            raise ValueError(f"{text!r}: a budget must be more than 0")
    return limits


def applied(scene: Scene, settings: Sequence[Setting]) -> Scene:
    """Returns the scene with one setting for each object; its film and storage do not change."""
    objects = []
    for item, setting in zip(scene.objects, settings, strict=True):
        quality = setting.quality.model_copy(update={"storage": None})
        objects.append(item.model_copy(update={"quality": quality}))
    whole = Quality() if scene.quality.storage is None else Quality(storage=scene.quality.storage)
    return scene.model_copy(update={"objects": tuple(objects), "quality": whole})


def simplest(scene: Scene, settings: Sequence[Setting]) -> list[Setting]:
    """Returns the settings, one for each object, without the values that change nothing for their object.

    A value is dropped if the object's programs, materials and vertices are the same without it.
    settings: one for each object.
    """
    result = list(settings)
    same = drawn_from(applied(scene, result))
    for name in (field.name for field in fields(Setting)):
        without = [replace(setting, **{name: getattr(EXACT, name)}) for setting in result]
        if without == result:
            continue
        changed = {old[0] for old, new in zip(same, drawn_from(applied(scene, without)), strict=True) if old != new}
        result = [result[number] if number in changed else setting for number, setting in enumerate(without)]
    return result


def words_of(setting: Setting) -> str:
    """Returns a setting in words, without its storage, which belongs to the film and not to an object."""
    return str(setting).rpartition(", ")[0]
