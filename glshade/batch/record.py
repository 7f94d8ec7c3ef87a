"""Record: the result of one task, as the manifest and the progress display need it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

from glshade.batch.task import without_empty

State = Literal["done", "skipped", "failed"]


@dataclass(frozen=True)
class Record:
    """The result of one task.

    number: index of the task in the batch
    output: path of the picture file
    state: "done", "skipped" (the file already held the picture) or "failed"
    digest: SHA-256 of everything that the picture depends on, as the file stores it; "" if unknown
    sha256: SHA-256 of the file's bytes; "" if the file was not read
    size: size of the file [bytes]
    seconds: step ("load", "draw" or "write") -> time spent in it [s]
    started: Unix time when drawing began [s]
    finished: Unix time when the file was closed [s]
    driver: OpenGL's renderer and version, or "float64 reference"
    device: EGL device of the worker; None if the driver chose
    attempts: number of times the picture was begun; more than 1 if a worker died
    error: message of the failure, one line for each fault
    exit_code: exit code that belongs to the failure, as docs/exit-codes.md lists them
    stops: True if the next pictures would fail for the same reason, such as a full disk or a folder without write permission
    warnings: messages of the warnings raised while the picture was made
    layers_sha256: SHA-256 of each separate file of layers, one after the other; "" if the picture has none
    seen: how the picture was seen, as `Calibration.as_dict`; empty if it was not drawn
    instances: the objects that the picture shows, as `coco.instances` returns them; empty if the task does not ask for them
    sample: the values that were drawn at random, by their dotted keys
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
    layers_sha256: str = ""
    seen: Mapping[str, Any] = field(default_factory=dict)
    instances: Mapping[str, Any] = field(default_factory=dict)
    sample: Mapping[str, Any] = field(default_factory=dict)

    @property
    def known(self) -> tuple[str, ...]:
        """The digest and the SHA-256 of each file, in the form of `Task.known`."""
        return tuple(filter(None, (self.digest, self.sha256, self.layers_sha256)))

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields as JSON types, without empty values."""
        return without_empty({f.name: getattr(self, f.name) for f in fields(self)})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Record:
        """Returns the record whose `as_dict` gave the data. The data may have been written to JSON and read back."""
        return cls(**{**data, "warnings": tuple(data.get("warnings", ()))})
