"""Pool: worker processes of one machine. One loop reads what they say, hands out tasks and buries the dead."""

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
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

from glshade.batch import leftovers
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import ContextError

RETRIES = 2
# A picture that takes longer is not handed out before its worker is free: another may be free earlier [s].
SLOW = 0.5
# A worker that is told to end, and does not, is killed after this [s].
PATIENCE = 10.0
# While no worker says anything, this often somebody looks whether to stop [s].
GLANCE = 0.1


class Process:
    """One worker, seen from its parent."""

    def __init__(self, backend: str, device: int | None, reference: bool, shares: bool) -> None:
        self.device = device
        command = [sys.executable, "-P", "-m", "glshade.batch.worker", backend, "-" if device is None else str(device)]
        environment = dict(os.environ)
        # The same glshade as here, wherever it lies.
        own = str(Path(__file__).resolve().parent.parent.parent)
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, [own, environment.get("PYTHONPATH")]))
        if shares:
            # llvmpipe would start a thread for every core in every worker: on two cores, 354 frames/s without against 225.
            environment.setdefault("LP_NUM_THREADS", "0")
        self.process = subprocess.Popen(
            [*command, *["reference"] * reference],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            # Ctrl-C is the parent's to hear.
            start_new_session=True,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.stdin, self.stdout = self.process.stdin, self.process.stdout
        self.greeted = False
        self.unusable = ""
        # By number: what it was given and has not finished; which of that it has begun.
        self.tasks: dict[int, Task] = {}
        self.begun: set[int] = set()
        self.alone = False
        self.quick = False
        self._rest = b""

    def takes(self) -> bool:
        """Whether it should have one more task."""
        if not self.greeted or self.stdin.closed or self.alone:
            return False
        return not self.tasks or (self.quick and len(self.begun) == len(self.tasks))

    def give(self, task: Task) -> None:
        """A worker that has died meanwhile takes it to the grave: its end is heard later."""
        self.tasks[task.number] = task
        with suppress(BrokenPipeError):
            self.stdin.write(json.dumps(task.as_dict()).encode() + b"\n")
            self.stdin.flush()

    def end(self) -> None:
        """It ends when it has done what it was given."""
        with suppress(BrokenPipeError):
            self.stdin.close()

    def hear(self) -> list[dict[str, Any]] | None:
        """What it has said since; None where it is dead."""
        data = os.read(self.stdout.fileno(), 1 << 16)
        if not data:
            return None
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [json.loads(line) for line in lines]


class Pool:
    """Worker processes, started at once. A context manager.

    devices: the EGL device of each, None for the driver's own choice. hardware: whether these are GPUs, and what draws on the
    CPU after all is let go. shares: whether they share the cores to draw. retries: how often a picture whose worker died is
    made again.
    """

    def __init__(
        self,
        devices: Sequence[int | None],
        *,
        backend: str = "auto",
        reference: bool = False,
        hardware: bool = False,
        shares: bool = False,
        retries: int = RETRIES,
    ) -> None:
        self.jobs = len(devices)
        self._hardware = hardware
        self.driver = ""
        self._retries = retries
        self._how = {"backend": backend, "reference": reference, "shares": shares}
        self._selector = selectors.DefaultSelector()
        self._workers: list[Process] = []
        self._pending: deque[Task] = deque()
        self._suspects: deque[Task] = deque()
        self._deaths: dict[int, int] = {}
        self._stillborn = 0
        self._resumed: set[int] = set()
        self._stopping = self._told = False
        for device in devices:
            self._start(device)

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Nothing is left: no process, no file half-written."""
        given = [task.output for worker in self._workers for task in worker.tasks.values()]
        for worker in self._workers:
            if worker.tasks or not worker.greeted:
                worker.process.kill()
            worker.end()
        for worker in self._workers:
            self._bury(worker)
        self._selector.close()
        leftovers.remove(given)

    def stop(self) -> None:
        """Nothing more is begun; what is begun will be finished.

        Called by signals too, perhaps in the middle of a task that is being handed out: the workers are told later.
        """
        self._stopping = True

    def ready(self) -> str:
        """Waits for the first worker, and says what it draws with. Errors: ContextError."""
        while not self.driver and self._workers and not self._stopping:
            for _ in self._hear():
                pass
        return self.driver

    def records(self, tasks: Iterable[Task]) -> Iterator[Record]:
        """What comes of the tasks, in the order in which it does. Errors: ContextError where no worker can draw.

        Ctrl-C stops, and raises KeyboardInterrupt when what is begun is finished; a second one raises it at once.
        """
        self._pending.extend(tasks)
        self._resumed = {task.number for task in self._pending if task.resume}
        with interrupts(self.stop) as interrupted:
            while self._feed():
                yield from self._hear()
        if interrupted:
            raise KeyboardInterrupt

    def _start(self, device: int | None) -> None:
        worker = Process(device=device, **self._how)  # type: ignore[arg-type]
        self._workers.append(worker)
        self._selector.register(worker.stdout, selectors.EVENT_READ, worker)

    def _feed(self) -> bool:
        """Hands out what there is, or says that it was all. Whether anything is still to come."""
        if self._stopping and not self._told:
            self._told = True
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

    def _hear(self) -> Iterator[Record]:
        """Waits a moment for what workers say."""
        for key, _ in self._selector.select(GLANCE):
            worker: Process = key.data
            events = worker.hear()
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
        if self._hardware and hello["on_cpu"]:
            worker.unusable = f"EGL device {worker.device} draws on the CPU: {hello['driver']}"
            warnings.warn(worker.unusable, stacklevel=2)
            worker.end()
            return
        worker.greeted = True
        self._stillborn = 0
        self.driver = self.driver or hello["driver"]

    def _finished(self, worker: Process, record: Record) -> Record:
        worker.alone = False
        worker.quick = record.seconds.get("load", 0.0) + record.seconds.get("draw", 0.0) < SLOW
        worker.begun.discard(record.number)
        del worker.tasks[record.number]
        if record.state == "skipped" and record.number not in self._resumed:
            # The worker that made it died before it could say so.
            record = replace(record, state="done")
        return replace(record, attempts=self._deaths.get(record.number, 0) + 1)

    def _died(self, worker: Process) -> Iterator[Record]:
        """What it had only been given goes back; what it had begun is made again alone, so that the culprit is certain."""
        self._workers.remove(worker)
        code = self._bury(worker)
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
                failed = Record(task.number, task.output, "failed", device=worker.device, error=error, exit_code=1)
                yield replace(failed, attempts=deaths)
            else:
                self._suspects.append(replace(task, resume=True))
        if (self._pending or self._suspects) and not self._stopping:
            self._start(worker.device)

    def _bury(self, worker: Process) -> int:
        """Waits until it has ended, kills it where it does not, and gives its exit code."""
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
    """An exit code, in words."""
    if code >= 0:
        return f"exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    return f"{name}: was memory short?" if name == "SIGKILL" else name


@contextmanager
def interrupts(stop: Any) -> Iterator[list[bool]]:
    """While it lasts, the first Ctrl-C stops and is noted in the list; the second interrupts."""
    interrupted: list[bool] = []

    def hear(*_: Any) -> None:
        if interrupted:
            raise KeyboardInterrupt
        interrupted.append(True)
        stop()

    try:
        before = signal.signal(signal.SIGINT, hear)
    except ValueError:
        # Signals are the main thread's.
        yield interrupted
        return
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)
