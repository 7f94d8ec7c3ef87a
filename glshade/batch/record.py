"""Record: what came of a task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

from glshade.batch.task import said

State = Literal["done", "skipped", "failed"]


@dataclass(frozen=True)
class Record:
    """What came of a task.

    number, output: the task's. digest: of all that the picture depends on, as it stands in the file. sha256, size: of the
    file [bytes]. seconds: by load, draw and write. started, finished: Unix times, when drawing began and when the file was
    closed [s]. device: the worker's EGL device, None for the driver's own choice. error: a line a fault. stops: the fault is
    the place's (a full disk, a folder without rights), and the next pictures would have it too.
    """

    number: int
    output: str
    state: State
    digest: str = ""
    sha256: str = ""
    size: int = 0
    seconds: Mapping[str, float] = field(default_factory=dict)
    started: float = 0.0
    finished: float = 0.0
    driver: str = ""
    device: int | None = None
    attempts: int = 1
    error: str = ""
    exit_code: int = 0
    stops: bool = False
    warnings: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """For JSON: what is not left out."""
        return said({f.name: getattr(self, f.name) for f in fields(self)})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Record:
        """What as_dict made, through JSON or not."""
        return cls(**{**data, "warnings": tuple(data.get("warnings", ()))})
