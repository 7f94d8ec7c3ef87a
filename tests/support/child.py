"""Child: a process that answers one line of JSON for each line of JSON, and that is replaced when it hangs or dies."""

from __future__ import annotations

import contextlib
import json
import os
import re
import resource
import select
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any


class Child:
    """A process that does questions one after another. A new one is started after each that hangs or dies.

    command: the command line of the process, which calls `serve`.
    seconds: the time after which a question counts as one without end [s].
    memory: the largest size of the process's data [bytes]; beyond it, the process gets a MemoryError.
    """

    def __init__(self, command: Sequence[str], seconds: float, memory: int) -> None:
        self._command, self._seconds, self._memory = list(command), seconds, memory
        self._process: subprocess.Popen[bytes] | None = None

    def ask(self, question: Any) -> dict[str, Any]:
        """Returns the answer to a question, or {"outcome": "hang" or "crash", "words": ...} where there is none."""
        process = self._process = self._process or self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(question).encode() + b"\n")
            process.stdin.flush()
            if not select.select([process.stdout], [], [], self._seconds)[0]:
                outcome = {"outcome": "hang", "words": f"no answer after {self._seconds:.0f} s"}
            else:
                return dict(json.loads(process.stdout.readline()))
        except (OSError, ValueError):
            outcome = {"outcome": "crash", "words": "the process died"}
        self.close()
        return outcome

    def close(self) -> None:
        """Ends the process, if it runs."""
        if self._process is not None:
            self._process.kill()
            with contextlib.suppress(BrokenPipeError):  # what could not be written to a dead process is still buffered
                self._process.communicate()
            self._process = None

    def _started(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (self._memory, self._memory)),
        )


def serve(answer: Callable[[Any], dict[str, Any]]) -> None:
    """Answers every question of stdin. What the answering code prints itself goes to stderr."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin.buffer:
        print(json.dumps(answer(json.loads(line))), file=answers, flush=True)


def forget_peak() -> int:
    """Sets the peak of this process's memory to its present size, and returns that size [bytes]."""
    Path("/proc/self/clear_refs").write_text("5")
    return peak()


def peak() -> int:
    """Returns the largest size that this process's memory has had since `forget_peak` [bytes]."""
    found = re.search(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())
    assert found is not None
    return int(found[1]) * 1024
