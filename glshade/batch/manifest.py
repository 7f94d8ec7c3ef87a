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


class Manifest:
    """The log file, open for appending. This class is a context manager.

    Errors: GlshadeError if the file cannot be read or written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._folder = path.resolve().parent
        # Output path -> (digest, SHA-256 of the file), for pictures that are done according to their last line.
        self._done: dict[str, tuple[str, str]] = {}
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_CLOEXEC", 0), 0o666)
            if stat.S_ISREG(os.fstat(self._file).st_mode):
                self._read()
        except OSError as error:
            raise GlshadeError(f"{path}: cannot be written: {error.strerror}") from None

    def __enter__(self) -> Manifest:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        os.close(self._file)

    def add(self, task: Task, record: Record) -> None:
        """Appends a line for the record.

        A skipped picture gets no line if the log says already that it is done. That line is missing if the process was killed
        before it wrote the line; the line is then written now.
        Errors: GlshadeError if the line cannot be written, as on a full disk.
        """
        output = os.path.relpath(os.path.abspath(record.output), self._folder)
        known = not record.digest or self._done.get(output) == (record.digest, record.sha256)
        if record.state == "skipped" and known:
            return
        line: dict[str, Any] = {"output": output, "state": "failed" if record.state == "failed" else "done"}
        line |= {"scene": task.scene, "frame": task.frame, "camera": task.camera, "overrides": dict(task.overrides)}
        line |= {key: value for key, value in record.as_dict().items() if key not in ("number", "output", "state", "stops")}
        data = json.dumps(without_empty(line)).encode() + b"\n"
        try:
            written = os.write(self._file, data)
        except OSError as error:
            raise GlshadeError(f"{self.path}: cannot be written: {error.strerror}") from None
        if written < len(data):
            raise GlshadeError(f"{self.path}: cannot be written whole: is the disk full?")
        self._note(line)

    def _read(self) -> None:
        """Collects the finished pictures, and cuts off an incomplete last line that a killed process left."""
        whole = 0
        with open(self._file, "rb", closefd=False) as file:
            for data in file:
                if not data.endswith(b"\n"):
                    os.ftruncate(self._file, whole)
                    return
                whole += len(data)
                try:
                    line = json.loads(data)
                except ValueError:
                    continue
                if isinstance(line, dict):
                    self._note(line)

    def _note(self, line: dict[str, Any]) -> None:
        output = line.get("output")
        if line.get("state") == "done":
            self._done[str(output)] = str(line.get("digest")), str(line.get("sha256"))
        else:
            self._done.pop(str(output), None)
