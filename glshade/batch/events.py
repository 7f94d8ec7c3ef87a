"""Events: tells a batch's progress as tables of JSON types, which `--json` prints and `glshade.render_all` hands over."""

from __future__ import annotations

from typing import Any

from glshade.batch.engine import Outcome
from glshade.batch.record import Record
from glshade.batch.task import Task


def began(pictures: int, jobs: int, driver: str) -> dict[str, Any]:
    """Returns the event before the first picture."""
    return {"event": "begin", "pictures": pictures, "jobs": jobs, "driver": driver}


def picture(task: Task, record: Record) -> dict[str, Any]:
    """Returns the event after a picture: its record, with the scene, frame and camera of its task."""
    given: dict[str, Any] = {"scene": task.scene, "frame": task.frame, "camera": task.camera}
    given = {key: value for key, value in given.items() if value is not None}
    result = record.as_dict()
    return {"event": result.pop("state"), **given, **result}


def ended(outcome: Outcome) -> dict[str, Any]:
    """Returns the event after the last picture."""
    names = ("done", "skipped", "failed", "left", "seconds", "seconds_pictures")
    return {"event": "end", **{name: getattr(outcome, name) for name in names}}
