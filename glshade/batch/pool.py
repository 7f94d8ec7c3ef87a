"""Pool: the engine whose workers are processes on this machine. One loop hands out tasks and replaces dead workers."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import warnings
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

from glshade.batch import leftovers
from glshade.batch.engine import RETRIES, SLOW, interrupts
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import ContextError

# A worker that was told to end and is still running after this time is killed [s].
PATIENCE = 10.0
# Longest wait for an event, after which the loop checks whether the batch is to stop [s].
GLANCE = 0.1


class Process:
    """One worker process, as its parent sees it."""

    def __init__(self, device: int | None, shares: bool, **arguments: Any) -> None:
        """Starts the process.

        device: EGL device of the worker; None if the driver chooses
        shares: True if several workers share the cores for drawing
        arguments: the other arguments of `worker.main`
        """
        self.device = device
        command = [sys.executable, "-P", "-m", "glshade.batch.worker", json.dumps({"device": device, **arguments})]
        environment = dict(os.environ)
        # The worker must import the same glshade as this process, even if it is not installed.
        root = str(Path(__file__).resolve().parent.parent.parent)
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, [root, environment.get("PYTHONPATH")]))
        if shares:
            # By default llvmpipe starts a thread for every core in every worker. On two cores, a batch made 225 frames/s with
            # these threads and 354 frames/s without them.
            environment.setdefault("LP_NUM_THREADS", "0")
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            # A terminal sends Ctrl-C to all processes of a session's foreground command. The worker has a session of its own,
            # so only the parent handles Ctrl-C.
            start_new_session=True,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.stdin, self.stdout = self.process.stdin, self.process.stdout
        # True once the worker has reported that it can draw.
        self.greeted = False
        # The reason why the worker cannot draw; "" if it can.
        self.unusable = ""
        # Task number -> task, for tasks that the worker was given and has not finished; and the numbers of tasks that it has
        # begun.
        self.tasks: dict[int, Task] = {}
        self.begun: set[int] = set()
        # True while the worker makes a suspect picture. Until it is finished, the worker gets no other task.
        self.alone = False
        # True if the worker's last picture took less than SLOW. Such a worker gets its next task before it is idle.
        self.quick = False
        # The incomplete last line of the worker's output.
        self._rest = b""

    def takes(self) -> bool:
        """Returns whether the worker should get one more task."""
        if not self.greeted or self.stdin.closed or self.alone:
            return False
        return not self.tasks or (self.quick and len(self.begun) == len(self.tasks))

    def give(self, task: Task) -> None:
        """Sends a task. If the worker has died in the meantime, the task stays in `tasks` until the loop notices."""
        self.tasks[task.number] = task
        with suppress(BrokenPipeError):
            self.stdin.write(json.dumps(task.as_dict()).encode() + b"\n")
            self.stdin.flush()

    def end(self) -> None:
        """Closes stdin, so that the worker ends once it has finished its tasks."""
        with suppress(BrokenPipeError):
            self.stdin.close()

    def read(self) -> list[dict[str, Any]] | None:
        """Returns the events since the last call, or None if the worker has ended."""
        data = os.read(self.stdout.fileno(), 1 << 16)
        if not data:
            return None
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [json.loads(line) for line in lines]


class Pool:
    """Worker processes, which the constructor starts. This class is a context manager.

    devices: EGL device of each worker; None if the driver chooses
    backend: OpenGL backend, as for Renderer
    reference: True if the float64 reference draws
    hardware: True if the devices are GPUs; a worker that draws on the CPU nevertheless is dismissed
    shares: True if the workers share the cores for drawing
    shaders: the user's own shader folders
    models: the user's own model folders
    retries: number of times that a picture is made again after its worker died
    """

    def __init__(
        self,
        devices: Sequence[int | None],
        *,
        backend: str = "auto",
        reference: bool = False,
        hardware: bool = False,
        shares: bool = False,
        shaders: Sequence[str] = (),
        models: Sequence[str] = (),
        retries: int = RETRIES,
    ) -> None:
        self.jobs = len(devices)
        self._hardware = hardware
        self.driver = ""
        self._retries = retries
        self._arguments: dict[str, Any] = {
            "backend": backend,
            "reference": reference,
            "shares": shares,
            "shaders": list(shaders),
            "models": list(models),
        }
        self._selector = selectors.DefaultSelector()
        self._workers: list[Process] = []
        self._pending: deque[Task] = deque()
        # Tasks whose worker died while it made them. Each of them is made again by a worker that has no other task.
        self._suspects: deque[Task] = deque()
        # Task number -> number of workers that died while they made it.
        self._deaths: dict[int, int] = {}
        # Number of workers that died one after another before they could draw.
        self._stillborn = 0
        # Numbers of the tasks for which the user asked to resume.
        self._resumed: set[int] = set()
        self._stopping = self._terminated = False
        for device in devices:
            self._start(device)

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Ends all workers, and removes their incomplete files."""
        outputs = [task.output for worker in self._workers for task in worker.tasks.values()]
        for worker in self._workers:
            if worker.tasks or not worker.greeted:
                worker.process.kill()
            worker.end()
        for worker in self._workers:
            self._wait(worker)
        self._selector.close()
        leftovers.remove(outputs)

    def stop(self) -> None:
        """Lets no further picture begin. Pictures that are begun are finished.

        A signal handler may call this while a task is being sent, so it only sets a flag; `_feed` terminates the workers.
        """
        self._stopping = True

    def ready(self) -> str:
        """Waits for the first worker, and returns the name of its driver. Errors: ContextError."""
        while not self.driver and self._workers and not self._stopping:
            for _ in self._listen():
                pass
        return self.driver

    def records(self, tasks: Iterable[Task]) -> Iterator[Record]:
        """Yields the tasks' records, in the order in which the pictures are finished.

        Errors: ContextError if no worker can draw; KeyboardInterrupt after Ctrl-C, once the pictures that were begun are
        finished. A second Ctrl-C raises it at once.
        """
        self._pending.extend(tasks)
        self._resumed = {task.number for task in self._pending if task.resume}
        with interrupts(self.stop) as interrupted:
            while self._feed():
                yield from self._listen()
        if interrupted:
            raise KeyboardInterrupt

    def _start(self, device: int | None) -> None:
        worker = Process(device, **self._arguments)
        self._workers.append(worker)
        self._selector.register(worker.stdout, selectors.EVENT_READ, worker)

    def _feed(self) -> bool:
        """Hands out tasks, or terminates the workers if the batch is to stop. Returns whether further records will come."""
        if self._stopping and not self._terminated:
            self._terminated = True
            for worker in self._workers:
                worker.process.terminate()
                worker.end()
        for worker in self._workers:
            while not self._stopping and worker.takes():
                if self._suspects and not worker.tasks:
                    worker.alone = True
                    worker.give(self._suspects.popleft())
                elif self._pending:
                    worker.give(self._pending.popleft())
                else:
                    break
        left = bool(self._pending or self._suspects) and not self._stopping
        return bool(self._workers) and (left or any(worker.tasks for worker in self._workers))

    def _listen(self) -> Iterator[Record]:
        """Waits up to GLANCE for events of the workers, and yields the records among them."""
        for key, _ in self._selector.select(GLANCE):
            worker: Process = key.data
            events = worker.read()
            if events is None:
                yield from self._died(worker)
            for event in events or ():
                if "hello" in event:
                    self._greet(worker, event["hello"])
                elif "unusable" in event:
                    worker.unusable = event["unusable"]
                elif "began" in event:
                    worker.begun.add(event["began"])
                else:
                    yield self._finished(worker, Record.from_dict(event["record"]))

    def _greet(self, worker: Process, hello: dict[str, Any]) -> None:
        """Accepts a worker that can draw, or dismisses it if it draws on the CPU although a GPU is required."""
        if self._hardware and hello["on_cpu"]:
            worker.unusable = f"EGL device {worker.device} draws on the CPU: {hello['driver']}"
            warnings.warn(worker.unusable, stacklevel=2)
            worker.end()
            return
        worker.greeted = True
        self._stillborn = 0
        self.driver = self.driver or hello["driver"]

    def _finished(self, worker: Process, record: Record) -> Record:
        """Removes a finished task from its worker, and returns its record with the number of attempts."""
        worker.alone = False
        worker.quick = record.seconds.get("load", 0.0) + record.seconds.get("draw", 0.0) < SLOW
        worker.begun.discard(record.number)
        del worker.tasks[record.number]
        if record.state == "skipped" and record.number not in self._resumed:
            # The worker that made the picture died before it could report the picture.
            record = replace(record, state="done")
        return replace(record, attempts=self._deaths.get(record.number, 0) + 1)

    def _died(self, worker: Process) -> Iterator[Record]:
        """Handles the death of a worker.

        Tasks that it had not begun return to the queue. Tasks that it had begun are made again one at a time. So it becomes
        certain which of them kills its worker.
        """
        self._workers.remove(worker)
        code = self._wait(worker)
        leftovers.remove(task.output for task in worker.tasks.values())
        if not worker.greeted and not self._stopping:
            self._stillborn += 1
            if not worker.unusable and self._stillborn <= self._retries:
                self._start(worker.device)
            elif not self._workers:
                raise ContextError(worker.unusable or f"the driver ends the process that opens it ({_cause(code)})")
            return
        begun = [task for number, task in worker.tasks.items() if number in worker.begun]
        self._pending.extendleft(reversed([task for number, task in worker.tasks.items() if number not in worker.begun]))
        for task in begun:
            self._deaths[task.number] = deaths = self._deaths.get(task.number, 0) + 1
            if len(begun) == 1 and deaths > self._retries:
                error = f"{task.output}: the driver ended the process that drew it, {deaths} times ({_cause(code)})"
                yield Record(
                    task.number, task.output, "failed", device=worker.device, attempts=deaths, error=error, exit_code=1
                )
            else:
                self._suspects.append(replace(task, resume=True))
        if (self._pending or self._suspects) and not self._stopping:
            self._start(worker.device)

    def _wait(self, worker: Process) -> int:
        """Waits until the worker has ended, kills it if it does not, and returns its exit code."""
        if worker.stdout in self._selector.get_map():
            self._selector.unregister(worker.stdout)
        worker.end()
        try:
            code = worker.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            worker.process.kill()
            code = worker.process.wait()
        worker.stdout.close()
        return code


def _cause(code: int) -> str:
    """Returns an exit code in words."""
    if code >= 0:
        return f"exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    return f"{name}: perhaps memory ran out" if name == "SIGKILL" else name
