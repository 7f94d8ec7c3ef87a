"""Manifest: an append-only log of a batch's pictures, one JSON object a line; the last line about a file is the valid one."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from types import TracebackType
from typing import Any

from glshade.batch.record import Record
from glshade.batch.task import Task, without_empty
from glshade.errors import GlshadeError

# Every line begins with this, so an incomplete first line can be told from the text of another file.
BEGINNING = b'{"output": '


class NoManifest(GlshadeError):
    """The file is not a manifest, so no line may be added to it or removed from it."""

    exit_code = 2


class Manifest:
    """The log file, open for appending. This class is a context manager.

    path: the file; it is made if it is not there.
    instances: True to keep what the lines tell about the objects in the pictures.

    Errors: GlshadeError if the file cannot be read or written; NoManifest if it holds something else than a manifest.
    """

    def __init__(self, path: Path, instances: bool = False) -> None:
        self.path = path
        self._folder = path.resolve().parent
        # Output path -> `Task.known`, for pictures that are done according to their last line.
        self._done: dict[str, tuple[str, ...]] = {}
        # Output path -> `Record.instances`; None where nobody asks for them, because masks take much memory.
        self._instances: dict[str, dict[str, Any]] | None = {} if instances else None
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_CLOEXEC", 0), 0o666)
        except OSError as error:
            raise self._fault(error) from None
        try:
            if stat.S_ISREG(os.fstat(self._file).st_mode):
                self._read()
        except BaseException as error:
            os.close(self._file)
            if isinstance(error, OSError):
                raise self._fault(error) from None
            raise

    def __enter__(self) -> Manifest:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        os.close(self._file)

    def known(self, output: str) -> tuple[str, ...]:
        """Returns the `Task.known` of a picture; empty if its last line does not say that it is done, or if it has no line."""
        return self._done.get(self._relative(output), ())

    def instances(self, output: str) -> dict[str, Any]:
        """Returns the objects that a finished picture shows; empty if the log does not tell them, or is not asked to."""
        name = self._relative(output)
        return (self._instances or {}).get(name, {}) if name in self._done else {}

    def add(self, task: Task, record: Record) -> None:
        """Appends a line for the record.

        A skipped picture gets no line if the log says already that it is done and, if asked, which objects it shows. That line
        is missing if the process was killed before it wrote the line; the line is then written now.
        Errors: GlshadeError if the line cannot be written, as on a full disk.
        """
        told = not record.instances or bool(self.instances(record.output))
        if record.state == "skipped" and (not record.digest or (self.known(record.output) == record.known and told)):
            return
        line: dict[str, Any] = {
            "output": self._relative(record.output),
            "state": "failed" if record.state == "failed" else "done",
        }
        line |= {"scene": task.scene, "frame": task.frame, "camera": task.camera, "overrides": dict(task.overrides)}
        line |= {key: value for key, value in record.as_dict().items() if key not in ("number", "output", "state", "stops")}
        data = json.dumps(without_empty(line)).encode() + b"\n"
        try:
            written = os.write(self._file, data)
        except OSError as error:
            raise self._fault(error) from None
        if written < len(data):
            raise GlshadeError(f"{self.path}: cannot be written whole: is the disk full?")
        self._note(line)

    def _relative(self, output: str) -> str:
        """Returns the path of a picture, relative to the manifest's folder."""
        return os.path.relpath(os.path.abspath(output), self._folder)

    def _read(self) -> None:
        """Collects the finished pictures, and cuts off an incomplete last line that a killed process left.

        Errors: NoManifest.
        """
        whole = 0
        with open(self._file, "rb", closefd=False) as file:
            for data in file:
                if whole == 0 and data[: len(BEGINNING)] != BEGINNING[: len(data)]:
                    raise NoManifest(f"{self.path}: is not a manifest, and is left as it is: name another file")
                if not data.endswith(b"\n"):
                    os.ftruncate(self._file, whole)
                    return
                whole += len(data)
                try:
                    line = json.loads(data)
                except (ValueError, RecursionError):
                    continue
                if isinstance(line, dict):
                    self._note(line)

    def _note(self, line: dict[str, Any]) -> None:
        output = str(line.get("output"))
        if line.get("state") == "done":
            texts = (line.get(key) for key in ("digest", "sha256", "layers_sha256"))
            self._done[output] = tuple(text for text in texts if isinstance(text, str) and text)
            if self._instances is not None and isinstance(line.get("instances"), dict):
                self._instances[output] = line["instances"]
        else:
            self._done.pop(output, None)

    def _fault(self, error: OSError) -> GlshadeError:
        return GlshadeError(f"{self.path}: cannot be written: {error.strerror}")
