"""The worker process: tasks on stdin, one JSON object a line; what comes of them on stdout.

It says `hello` with its driver, or `unusable` with the reason; then `began` and the task's number where drawing begins, and
`record`. It ends when stdin does, and so when its parent dies; told to terminate, it finishes what it has begun.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import traceback
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from glshade.batch.maker import Drawn, Maker
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import ContextError

# Threads that write: a PNG takes up to twice as long to encode as to draw.
WRITERS = 2
# Renderers that are the CPU.
SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "software rasterizer")


class Worker:
    """Draws on the main thread, in the order of the tasks, and writes on others."""

    def __init__(self, maker: Maker, events: int) -> None:
        """events: the descriptor that events are written to."""
        self.maker = maker
        self._events = events
        self._lock = threading.Lock()
        # One picture is drawn while the others are written; more would only take memory.
        self._room = threading.BoundedSemaphore(WRITERS + 1)
        self._stopping = threading.Event()

    def stop(self, *_: Any) -> None:
        """Begins nothing more."""
        self._stopping.set()

    def open(self, reference: bool) -> bool:
        """Whether there is something to draw with; says so."""
        if reference:
            self._say({"hello": {"driver": "float64 reference", "on_cpu": True}})
            return True
        try:
            driver = self.maker.driver
        except ContextError as error:
            self._say({"unusable": str(error)})
            return False
        self._say({"hello": {"driver": driver, "on_cpu": any(name in driver.lower() for name in SOFTWARE)}})
        return True

    def work(self) -> None:
        """Until stdin ends."""
        parent = os.getppid()
        with ThreadPoolExecutor(WRITERS) as writers:
            for line in sys.stdin.buffer:
                # A parent that is gone leaves an orphan.
                if self._stopping.is_set() or os.getppid() != parent:
                    return
                task = Task.from_dict(json.loads(line))
                self._room.acquire()
                self._say({"began": task.number})
                try:
                    drawn = self.maker.draw(task)
                except Exception as error:
                    drawn = fault(task.number, task.output, error)
                if isinstance(drawn, Record):
                    self._finish(drawn)
                else:
                    writers.submit(self._write, drawn)

    def _write(self, drawn: Drawn) -> None:
        try:
            record = drawn.write()
        except Exception as error:
            record = fault(drawn.record.number, drawn.record.output, error)
        self._finish(record)

    def _finish(self, record: Record) -> None:
        self._say({"record": record.as_dict()})
        self._room.release()

    def _say(self, event: dict[str, Any]) -> None:
        data = json.dumps(event, separators=(",", ":")).encode() + b"\n"
        with self._lock:
            try:
                while data:
                    data = data[os.write(self._events, data) :]
            except BrokenPipeError:
                # Nobody listens: the pictures are files all the same.
                self._stopping.set()


def fault(number: int, output: str, error: Exception) -> Record:
    """What is none of FAULTS is a fault in glshade, and no reason to leave the other pictures unmade."""
    traceback.print_exc()
    return Record(number, output, "failed", error=f"{output}: {type(error).__name__}: {error}", exit_code=1)


def main() -> None:
    """Arguments: backend, device or "-", and "reference" where no driver is needed."""
    backend, device, *rest = sys.argv[1:]
    events = os.dup(1)
    # Drivers print.
    os.dup2(2, 1)
    maker = Maker(backend, None if device == "-" else int(device))  # type: ignore[arg-type]
    worker = Worker(maker, events)
    signal.signal(signal.SIGTERM, worker.stop)
    if worker.open("reference" in rest):
        worker.work()
    # All is written. Taking interpreter and driver apart would take 0.1 s, which the parent waits for.
    sys.stderr.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
