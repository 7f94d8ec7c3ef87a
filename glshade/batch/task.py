"""Task: one picture to make, described by strings and numbers so that any process on any machine can make it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any


@dataclass(frozen=True)
class Task:
    """One picture to make.

    number: index of the picture in the batch
    scene: path of the scene or mesh file, as the user gave it
    output: path of the picture file, as the user gave it
    overrides: (key, text) pairs, as `glshade.load` takes them
    frame: frame number of the animation; None draws the scene without animation
    camera: name of one of the scene's `cameras`; None selects the scene's main camera
    film: keys of the film with the values that replace the scene's
    limits: fields of Limits with the values that replace the defaults
    shading: "flat", "gouraud" or "phong" for the whole picture; None keeps each object's own
    reference: True draws with the float64 reference
    tile: largest side of a region that is drawn in one piece [pixels]; None leaves it to the renderer
    settings: `Setting.as_dict` of each object, as --budget or --deadline chose them; None keeps the scene's settings
    resume: True leaves the output file alone if it already holds this picture
    instances: True if the record must tell which objects the picture shows, and where
    known: digest of the picture and SHA-256 of each of its files, as the manifest records them; empty if it has no record
    """

    number: int
    scene: str
    output: str
    overrides: tuple[tuple[str, str], ...] = ()
    frame: int | None = None
    camera: str | None = None
    film: Mapping[str, Any] = field(default_factory=dict)
    limits: Mapping[str, Any] = field(default_factory=dict)
    shading: str | None = None
    reference: bool = False
    tile: int | None = None
    settings: tuple[Mapping[str, Any], ...] | None = None
    resume: bool = False
    instances: bool = False
    known: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields as JSON types, without empty values."""
        return without_empty({f.name: getattr(self, f.name) for f in fields(self)})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Task:
        """Returns the task whose `as_dict` gave the data. The data may have been written to JSON and read back."""
        settings = data.get("settings")
        overrides = tuple((key, text) for key, text in data.get("overrides", ()))
        known = tuple(data.get("known", ()))
        return cls(**{**data, "overrides": overrides, "settings": settings and tuple(settings), "known": known})

    def absolute(self) -> Task:
        """Returns the task with absolute paths, for a process that has another working directory."""
        return replace(self, scene=os.path.abspath(self.scene), output=os.path.abspath(self.output))


def without_empty(values: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the values without None, False and empty ones. Integers stay, because 0 is a frame number."""
    return {name: value for name, value in values.items() if value or type(value) is int}
