"""Worker: the process of a Pool that reads tasks from stdin and writes events to stdout, one JSON object a line.

The first event is `hello` with the driver, or `unusable` with the reason. For each task, `began` with the task's number is sent
when drawing begins, and `record` when the file is written. The process ends when stdin is closed. stdin is closed, too, when
the parent process dies. On SIGTERM, the process finishes the pictures that it has begun and ends.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from glshade.batch.engine import WRITERS, fault
from glshade.batch.maker import Drawn, Maker
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import GlshadeError
from glshade.startup import shorten


class Worker:
    """Draws on the main thread, in the order of the tasks, and writes files on other threads."""

    maker: Maker

    def __init__(self, events: int) -> None:
        """Takes the file descriptor to which events are written."""
        self._events = events
        self._lock = threading.Lock()
        # Limits the number of pictures in memory: one is drawn while each writer writes one. More pictures would take memory
        # and save no time.
        self._room = threading.BoundedSemaphore(WRITERS + 1)
        self._stopping = threading.Event()

    def stop(self, *_: Any) -> None:
        """Lets no further picture begin."""
        self._stopping.set()

    def open(self, reference: bool, arguments: dict[str, Any]) -> bool:
        """Makes the maker, opens the driver, sends `hello` or `unusable`, and returns whether pictures can be drawn.

        reference: True if the float64 reference draws, which needs no driver.
        arguments: the arguments of Maker.
        """
        try:
            self.maker = Maker(**arguments)
            if reference:
                self._send({"hello": {"driver": "float64 reference", "on_cpu": True}})
                return True
            driver = self.maker.driver
        except GlshadeError as error:
            self._send({"unusable": str(error)})
            return False
        self._send({"hello": {"driver": driver, "on_cpu": self.maker.renderer.context.is_software}})
        return True

    def work(self) -> None:
        """Makes the pictures until stdin is closed."""
        parent = os.getppid()
        with ThreadPoolExecutor(WRITERS) as writers:
            for line in sys.stdin.buffer:
                # If the parent has died, the operating system gives this process another parent. Nobody needs its pictures
                # then.
                if self._stopping.is_set() or os.getppid() != parent:
                    return
                task = Task.from_dict(json.loads(line))
                self._room.acquire()
                self._send({"began": task.number})
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
        self._send({"record": record.as_dict()})
        self._room.release()

    def _send(self, event: dict[str, Any]) -> None:
        data = json.dumps(event, separators=(",", ":")).encode() + b"\n"
        with self._lock:
            try:
                while data:
                    data = data[os.write(self._events, data) :]
            except BrokenPipeError:
                # The parent has died. No further picture is begun, and those that are begun are still written.
                self._stopping.set()


def main() -> None:
    """Runs a worker. Its command-line argument is a JSON object with the arguments of Maker, and with `reference`.

    reference: true if the float64 reference draws.
    """
    shorten()
    arguments = json.loads(sys.argv[1])
    reference = arguments.pop("reference")
    events = os.dup(1)
    # Drivers print to stdout. Events have a file descriptor of their own, so that such text cannot corrupt them.
    os.dup2(2, 1)
    worker = Worker(events)
    signal.signal(signal.SIGTERM, worker.stop)
    if worker.open(reference, arguments):
        worker.work()
    # All files are written. Skip the shutdown of interpreter and driver, for which the parent would wait 0.1 s.
    sys.stderr.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
