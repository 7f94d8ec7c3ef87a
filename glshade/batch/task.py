"""Task: one picture to make, in texts and numbers, so that any process on any machine can make it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any


@dataclass(frozen=True)
class Task:
    """One picture to make.

    number: its place in the batch. scene, output: files, as they were said. overrides: (key, text), as `glshade.load` takes
    them. frame, camera: None is the scene as it is written. film: changes of the film's keys. settings: a budget's choice,
    one a knob's values for each object (`Setting.as_dict`). resume: a file that has this very picture is left as it is.
    """

    number: int
    scene: str
    output: str
    overrides: tuple[tuple[str, str], ...] = ()
    frame: int | None = None
    camera: str | None = None
    film: Mapping[str, Any] = field(default_factory=dict)
    shading: str | None = None
    reference: bool = False
    tile: int | None = None
    settings: tuple[Mapping[str, Any], ...] | None = None
    resume: bool = False

    def as_dict(self) -> dict[str, Any]:
        """For JSON: what is not left out."""
        return said({f.name: getattr(self, f.name) for f in fields(self)})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Task:
        """What as_dict made, through JSON or not."""
        settings = data.get("settings")
        overrides = tuple((key, text) for key, text in data.get("overrides", ()))
        return cls(**{**data, "overrides": overrides, "settings": settings and tuple(settings)})

    def absolute(self) -> Task:
        """The same for a process with another working folder."""
        return replace(self, scene=os.path.abspath(self.scene), output=os.path.abspath(self.output))


def said(values: Mapping[str, Any]) -> dict[str, Any]:
    """Without what says nothing: None, False and what is empty. A whole number always does: there is a frame 0."""
    return {name: value for name, value in values.items() if value or type(value) is int}
