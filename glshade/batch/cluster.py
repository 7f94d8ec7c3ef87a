"""Cluster: a batch's workers on dask.distributed, of this machine or of many. Used as a Pool is; the pictures are the same.

A dask task is a parcel of pictures. The scheduler runs it again elsewhere where its worker dies, unasked; so every picture
takes along when its file was last written, and a file that is newer by then is asked for its digest before anything is drawn.
"""

from __future__ import annotations

import logging
import os
import queue
import re
import signal
import socket
import warnings
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice
from time import monotonic, perf_counter
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypedDict
from uuid import uuid4

from glshade.batch import leftovers
from glshade.batch.digest import code
from glshade.batch.maker import Drawn, Maker
from glshade.batch.pool import RETRIES, SLOW, interrupts
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.batch.worker import SOFTWARE, WRITERS, fault
from glshade.errors import ContextError, GlshadeError, MissingLibrary
from glshade.version import __version__

if TYPE_CHECKING:
    import distributed

LOCAL = "local"
ADDRESS = re.compile(r"(tcp|tls)://[^/\s]+:\d+")
# The environment of a worker says here which of EGL's devices is its own.
DEVICE = "GLSHADE_DEVICE"
# The resource that workers with a GPU declare: where some do, the others are left alone.
GPU = "GPU"
# A parcel takes about this long [s], against the 5 to 10 ms that dask takes for it, and has no more pictures than this.
PARCEL_SECONDS, PARCEL_PICTURES = 0.25, 32
# Parcels that a worker has at most: one to draw, one to begin while dask hears of the first.
AHEAD = 2
# A scheduler that is there answers within this [s].
CONNECTING = 10.0
# The workers are counted again after this [s]: they come and go. A thousand of them are a message of about a megabyte.
COUNTING = 5.0
# Without a worker for this long, there is something to say [s]; a cluster of our own will then never have one.
LONELY = 30.0
# While nothing is heard, this often somebody looks why [s].
GLANCE = 0.5


def check_address(address: str) -> None:
    """Errors: ValueError."""
    if address != LOCAL and not ADDRESS.fullmatch(address):
        raise ValueError(f"{address!r} is neither {LOCAL} nor a scheduler's address such as tcp://host:8786")


class How(TypedDict):
    """What all pictures of a batch have in common. code: what the client would make them with. hardware: on a GPU, or not."""

    code: str
    backend: str
    device: int | None
    reference: bool
    hardware: bool


@dataclass(frozen=True)
class Ordered:
    """A task, and when its file had been written when the task was given out [ns]; 0 where there was none."""

    task: Task
    written: int


@dataclass(frozen=True)
class Parcel:
    """What a dask task makes. alone: nothing else of the batch is under way."""

    future: distributed.Future[Any]
    orders: tuple[Ordered, ...]
    alone: bool


# ---- in the workers


@cache
def _thread() -> ThreadPoolExecutor:
    """The one thread of this process that draws: a context is a thread's, and dask may have given the worker several."""
    return ThreadPoolExecutor(1, thread_name_prefix="glshade")


_makers: dict[tuple[str, int | None], Maker] = {}


def make(orders: Sequence[tuple[dict[str, Any], int]], how: How) -> dict[str, Any]:
    """A parcel, in a worker: (Task.as_dict(), Ordered.written). What draws, how long it took, and the records, as dictionaries.

    Errors: ContextError where nothing can be drawn with; GlshadeError where this is not the client's glshade.
    """
    return _thread().submit(_make_here, orders, how).result()


def _make_here(orders: Sequence[tuple[dict[str, Any], int]], how: How) -> dict[str, Any]:
    if code() != how["code"]:
        raise GlshadeError(
            f"the worker on {socket.gethostname()} has another glshade (version {__version__}), other shaders or another "
            "OpenImageIO than this command: install the same everywhere, and start the workers again"
        )
    device = int(os.environ.get(DEVICE, -1))
    key = how["backend"], how["device"] if device < 0 else device
    maker = _makers.get(key) or _makers.setdefault(key, Maker(*key))  # type: ignore[arg-type]
    try:
        driver = "float64 reference" if how["reference"] else maker.driver
    except ContextError as error:
        raise ContextError(f"the worker on {socket.gethostname()}: {error}") from None
    if how["hardware"] and any(name in driver.lower() for name in SOFTWARE):
        on = "the driver's own choice" if key[1] is None else f"EGL device {key[1]}"
        raise ContextError(f"the worker on {socket.gethostname()} has a GPU, but {on} draws on the CPU: {driver}; see {DEVICE}")
    begun = perf_counter()
    made: list[Future[Record]] = []
    with ThreadPoolExecutor(WRITERS) as writers:
        for data, written in orders:
            if len(made) > WRITERS:
                # One is drawn while the others are written; more would only take memory.
                made[-WRITERS - 1].result()
            task = Task.from_dict(data)
            try:
                drawn: Drawn | Record = maker.draw(replace(task, resume=task.resume or _written(task.output) != written))
            except Exception as error:
                drawn = fault(task.number, task.output, error)
            if isinstance(drawn, Record) and drawn.state == "skipped" and not task.resume:
                # The worker that made it died before it could say so.
                drawn = replace(drawn, state="done")
            made.append(writers.submit(_write, drawn))
    records = [record.result().as_dict() for record in made]
    return {"driver": driver, "seconds": perf_counter() - begun, "records": records}


def _write(drawn: Drawn | Record) -> Record:
    if isinstance(drawn, Record):
        return drawn
    try:
        return drawn.write()
    except Exception as error:
        return fault(drawn.record.number, drawn.record.output, error)


def _forget() -> None:
    """Gives the contexts back, when what is being drawn is done."""

    def close() -> None:
        for maker in _makers.values():
            maker.close()
        _makers.clear()

    _thread().submit(close)


def _written(output: str) -> int:
    try:
        return os.stat(output).st_mtime_ns
    except OSError:
        return 0


def dask_setup(worker: Any) -> None:
    """Called by dask in workers of our own, on their main thread: Ctrl-C is the client's to hear, and stdout its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Drivers print.
    os.dup2(2, 1)


# ---- in the client


def _sendable() -> Any:
    """`make`, in a form that goes by value: dask's schedulers and workers take no notice of glshade before it runs.

    A worker without glshade would die of a function that it cannot import; of this one it says so.
    """

    def imported(*arguments: Any) -> Any:
        from glshade.batch.cluster import make

        return make(*arguments)

    return imported


class Cluster:
    """Workers, by a scheduler's address or, "local", started at once. A context manager.

    devices: of "local", the EGL device of each worker, None for the driver's own choice; of a scheduler, the first is for
    workers whose environment has no GLSHADE_DEVICE. hardware: whether those of local workers are GPUs. shares: whether local
    workers share the cores to draw. retries: how often a picture whose worker died is made again.
    Errors: MissingLibrary, ValueError for an address, GlshadeError where no scheduler answers or none can be started.
    """

    def __init__(
        self,
        address: str,
        devices: Sequence[int | None] = (None,),
        *,
        backend: str = "auto",
        reference: bool = False,
        hardware: bool = False,
        shares: bool = False,
        retries: int = RETRIES,
    ) -> None:
        check_address(address)
        try:
            import distributed
        except ImportError:
            raise MissingLibrary("--cluster needs dask.distributed: pip install 'glshade[dist]'") from None
        # What goes wrong is said here, and once.
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self.address = address
        self.driver = ""
        self._drivers: set[str] = set()
        self._retries = retries
        self._local = _started(devices, hardware, shares) if address == LOCAL else None
        self._how: How = {
            "code": code(),
            "backend": backend,
            "device": None if self._local else devices[0],
            "reference": reference,
            "hardware": False,
        }
        try:
            self._client = distributed.Client(self._local or address, timeout=CONNECTING, set_as_default=False)
        except (OSError, TimeoutError) as error:
            self._close_local()
            raise GlshadeError(f"no dask scheduler answers at {address}: {_one_line(error)}") from None
        self._name = f"glshade-{uuid4().hex[:8]}"
        self._sent = 0
        self._flight: dict[str, Parcel] = {}
        self._arrived: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._waiting: Iterator[Task] = iter(())
        self._suspects: deque[Ordered] = deque()
        self._deaths: dict[int, int] = {}
        # What workers that died had been given.
        self._spoiled: list[str] = []
        self._stillborn = 0
        # Of the latest parcel: seconds a picture; how many pictures the next has.
        self._each, self._size = 0.0, 1
        self._counted = self._seen = monotonic()
        self.jobs, self._resources = 0, dict[str, float]()
        self._stopping = self._lonely = False
        self._count()

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Nothing of ours is left: no process, no context, no file half-written by workers of our own."""
        given = [order.task.output for parcel in self._flight.values() for order in parcel.orders]
        if self._local is None and not given and self.driver and self._client.status == "running":
            self._client.run(_forget, on_error="ignore")
        self._client.close(timeout=CONNECTING)
        if self._local is not None:
            self._close_local(at_once=bool(given))
            # Not earlier: a worker that is lost may not have ended, and what runs is left alone.
            leftovers.remove([*given, *self._spoiled])

    def stop(self) -> None:
        """Nothing more is handed out; what is will be finished."""
        self._stopping = True

    def ready(self) -> str:
        """Waits for the first worker, and says what it draws with. Errors: as `records`."""
        with interrupts(self.stop) as interrupted:
            self._send(())
            while not self.driver and not self._stopping:
                for _ in self._hear():
                    pass
        if interrupted:
            raise KeyboardInterrupt
        self._count()
        return self.driver

    def records(self, tasks: Iterable[Task]) -> Iterator[Record]:
        """What comes of the tasks, in the order in which it does.

        Errors: ContextError where a worker cannot draw; GlshadeError where the scheduler is lost, or a worker has another
        glshade. Ctrl-C stops, and raises KeyboardInterrupt when what is handed out is finished; a second one raises it at once.
        """
        self._waiting = iter(tasks)
        with interrupts(self.stop) as interrupted:
            while self._feed():
                yield from self._hear()
        if interrupted:
            raise KeyboardInterrupt

    def _feed(self) -> bool:
        """Hands out what there is. Whether anything is still to come."""
        room = (1 if self._each > SLOW else AHEAD) * max(self.jobs, 1)
        while not self._stopping and len(self._flight) < room:
            tasks = [*islice(self._waiting, self._size)]
            if not tasks:
                break
            self._send([Ordered(task, _written(task.output)) for task in tasks])
        if self._suspects and not self._flight and not self._stopping:
            # By itself, so that it is certain who dies of it.
            self._send([self._suspects.popleft()], alone=True)
        return bool(self._flight)

    def _send(self, orders: Sequence[Ordered], alone: bool = False) -> None:
        self._sent += 1
        key = f"{self._name}-{self._sent}"
        future = self._client.submit(
            _sendable(),
            [(order.task.absolute().as_dict(), order.written) for order in orders],
            {**self._how},
            key=key,
            resources=self._resources or None,
            pure=False,
        )
        self._flight[key] = Parcel(future, tuple(orders), alone)
        future.add_done_callback(lambda future: self._arrived.put(future.key))

    def _hear(self) -> Iterator[Record]:
        """Waits a moment for a parcel."""
        try:
            parcel = self._flight.pop(self._arrived.get(timeout=GLANCE))
        except queue.Empty:
            self._look()
            return
        yield from self._opened(parcel)
        if monotonic() > self._counted + COUNTING:
            self._count()

    def _opened(self, parcel: Parcel) -> Iterator[Record]:
        from distributed import KilledWorker

        try:
            made = parcel.future.result()
        except KilledWorker as error:
            yield from self._killed(parcel, error)
        except GlshadeError as error:
            # dask's way to it is nobody's business.
            raise error.with_traceback(None) from None
        except (CancelledError, OSError, TimeoutError):
            self._raise_lost()
        except (ImportError, RuntimeError) as error:
            raise GlshadeError(
                f"a worker of {self.address} cannot run glshade {__version__}: {_one_line(error)}; install the same there"
            ) from None
        else:
            yield from self._made(parcel, made)

    def _made(self, parcel: Parcel, made: dict[str, Any]) -> Iterator[Record]:
        self._seen = monotonic()
        self.driver = self.driver or made["driver"]
        if made["driver"] not in self._drivers and self._drivers:
            warnings.warn(f"the workers have several drivers, whose pictures differ: {made['driver']}", stacklevel=2)
        self._drivers.add(made["driver"])
        if parcel.orders:
            self._each = made["seconds"] / len(parcel.orders)
            # Not at once: the first picture of a worker takes longer than the others, and the first of a scene too.
            self._size = max(1, min(2 * self._size, PARCEL_PICTURES, int(PARCEL_SECONDS / max(self._each, 1e-6))))
        for order, data in zip(parcel.orders, made["records"], strict=True):
            attempts = self._deaths.pop(order.task.number, 0) + 1
            yield replace(Record.from_dict(data), output=order.task.output, attempts=attempts)

    def _killed(self, parcel: Parcel, error: distributed.KilledWorker) -> Iterator[Record]:
        """Each is made again by itself, so that the culprit is certain; the culprit, as often as is allowed."""
        deaths = error.allowed_failures + 1
        if not parcel.orders:
            self._stillborn += deaths
            if self._stillborn > self._retries:
                raise ContextError(f"the driver ends the process that opens it: {self._stillborn} workers died of it")
            self._send(())
        self._spoiled.extend(order.task.output for order in parcel.orders)
        for order in parcel.orders:
            number, output = order.task.number, order.task.output
            self._deaths[number] = self._deaths.get(number, 0) + deaths
            if parcel.alone and self._deaths[number] > self._retries:
                attempts = self._deaths.pop(number)
                said = f"{output}: the worker that drew it died, {attempts} times: a fault of the driver, or too little memory?"
                yield Record(number, output, "failed", attempts=attempts, error=said, exit_code=1)
            else:
                self._suspects.append(order)

    def _look(self) -> None:
        """When nothing is heard: is anybody there?"""
        if self._client.status not in {"running", "connecting"}:
            self._raise_lost()
        if monotonic() > self._counted + COUNTING:
            self._count()
        if self.jobs:
            self._seen = monotonic()
        elif monotonic() > self._seen + LONELY and not self._lonely:
            if self._local is not None:
                raise GlshadeError(f"no worker has lived on this machine for {LONELY:.0f} s")
            self._lonely = True
            warnings.warn(f"the scheduler at {self.address} has no workers: waiting for the first", stacklevel=2)

    def _count(self) -> None:
        """How many workers there are, and whether they have to be asked for by their GPUs."""
        try:
            workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
        except (OSError, TimeoutError):
            self._raise_lost()
        with_gpu = [worker for worker in workers if worker["resources"].get(GPU, 0) >= 1]
        self.jobs, self._resources = len(with_gpu or workers), {GPU: 1.0} if with_gpu else {}
        self._how["hardware"] = bool(with_gpu) and not self._how["reference"]
        self._counted = monotonic()

    def _raise_lost(self) -> None:
        raise GlshadeError(
            f"the scheduler at {self.address} is lost; the pictures that are there count: go on with --resume when it is back"
        ) from None

    def _close_local(self, at_once: bool = False) -> None:
        if self._local is None:
            return
        if at_once:
            # Those that draw would be waited for.
            for worker in self._local.workers.values():
                process = worker.process and worker.process.process
                if process is not None:
                    worker.auto_restart = False
                    os.kill(process.pid, signal.SIGKILL)
        self._local.close(timeout=CONNECTING)


def _started(devices: Sequence[int | None], hardware: bool, shares: bool) -> distributed.SpecCluster:
    """A scheduler in this process, and a worker for each device. (LocalCluster's workers have one environment in common.)"""
    import dask
    from distributed import Nanny, Scheduler, SpecCluster

    host = "127.0.0.1"
    # llvmpipe would start a thread for every core in every worker.
    common = {"LP_NUM_THREADS": os.environ.get("LP_NUM_THREADS", "0")} if shares else {}
    workers = {
        number: {
            "cls": Nanny,
            "options": {
                "host": host,
                "nthreads": 1,
                "resources": {GPU: 1} if hardware else {},
                # Pictures are not dask's data: it would pause or kill for what the driver holds.
                "memory_limit": 0,
                "dashboard": False,
                "env": common if device is None else {**common, DEVICE: str(device)},
                "preload": [__name__],
            },
        }
        for number, device in enumerate(devices)
    }
    # What dies is looked into here, after one death. A worker that is drawing may not answer for minutes.
    # Any free port for its HTTP server too: of two clusters on a machine the second would warn that it is not the first.
    free = {"port": 0, "dashboard_address": f"{host}:0"}
    options = {"host": host, **free, "dashboard": False, "allowed_failures": 0}
    quiet = {"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical"}
    with dask.config.set({"distributed.scheduler.worker-ttl": None, **quiet}):
        try:
            return SpecCluster(workers=workers, scheduler={"cls": Scheduler, "options": options})
        except (OSError, RuntimeError) as error:
            raise GlshadeError(f"no workers can be started on this machine: {_one_line(error)}") from None


def _one_line(error: BaseException) -> str:
    return "; ".join(line.strip() for line in str(error).splitlines() if line.strip()) or type(error).__name__
