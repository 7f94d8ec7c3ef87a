"""Manifest: what came of every picture of a batch, one JSON object a line. A log: of an output, the last line holds."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from types import TracebackType
from typing import Any

from glshade.batch.record import Record
from glshade.batch.task import Task, said
from glshade.errors import GlshadeError


class Manifest:
    """The file, open to be added to. A context manager. Errors: GlshadeError where it cannot be read or written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._folder = path.resolve().parent
        # output -> digest and hash, where it is done.
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
        """A line for the record. None for what is skipped and has its line; a picture whose line was lost gets it now.

        Errors: GlshadeError, such as for a full disk.
        """
        output = os.path.relpath(os.path.abspath(record.output), self._folder)
        known = not record.digest or self._done.get(output) == (record.digest, record.sha256)
        if record.state == "skipped" and known:
            return
        line: dict[str, Any] = {"output": output, "state": "failed" if record.state == "failed" else "done"}
        line |= {"scene": task.scene, "frame": task.frame, "camera": task.camera, "overrides": dict(task.overrides)}
        line |= {key: value for key, value in record.as_dict().items() if key not in ("number", "output", "state", "stops")}
        data = json.dumps(said(line)).encode() + b"\n"
        try:
            written = os.write(self._file, data)
        except OSError as error:
            raise GlshadeError(f"{self.path}: cannot be written: {error.strerror}") from None
        if written < len(data):
            raise GlshadeError(f"{self.path}: cannot be written whole: is the disk full?")
        self._note(line)

    def _read(self) -> None:
        """What is done, from whole lines; what a kill left of another goes."""
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
