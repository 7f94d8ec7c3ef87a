"""Cluster: the engine with workers of dask.distributed, on this machine or on many. It makes the same pictures as a Pool.

A dask task is a parcel of pictures. If the worker of a parcel dies, the scheduler runs the parcel again on another worker
without asking. So every picture is sent with the time at which its file was last written. If the file is newer when the parcel
runs, the picture is drawn again, and written again only if the file holds other bytes.
"""

from __future__ import annotations

import logging
import os
import queue
import re
import signal
import warnings
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from itertools import islice
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from glshade.batch import leftovers
from glshade.batch.digest import code_digest
from glshade.batch.engine import RETRIES, SLOW, interrupts
from glshade.batch.parcel import DEVICE, Conditions, forget, time_written
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import ContextError, GlshadeError, MissingLibrary
from glshade.version import __version__

if TYPE_CHECKING:
    import distributed

# The address for which a scheduler and workers are started on this machine.
LOCAL = "local"
# The pattern of a scheduler's address.
ADDRESS = re.compile(r"(tcp|tls)://[^/\s]+:\d+")
# Name of the dask resource that workers with a GPU declare. If any worker declares it, only those workers get pictures.
GPU = "GPU"
# Time that a parcel should take [s], which is much longer than the 5 to 10 ms that dask needs for a task; and largest number of
# pictures in a parcel.
PARCEL_SECONDS, PARCEL_PICTURES = 0.25, 32
# Largest number of parcels for each worker: one that it draws, and another that it can begin while dask handles the first.
AHEAD = 2
# Timeout for the connection to a scheduler [s].
CONNECTING = 10.0
# Time after which the workers are counted again, because they come and go [s]. They are not counted more often, because a list
# of 1,000 workers has about a megabyte.
COUNTING = 5.0
# Time without any worker after which the user is warned [s]. A local cluster fails after this time, because it gets no further
# workers.
LONELY = 30.0
# Longest wait for a parcel, after which the state of the scheduler is checked [s].
GLANCE = 0.5


def check_address(address: str) -> None:
    """Checks that an address is "local" or has the form of a scheduler's address. Errors: ValueError."""
    if address != LOCAL and not ADDRESS.fullmatch(address):
        raise ValueError(f"{address!r} is neither {LOCAL} nor a scheduler's address such as tcp://host:8786")


@dataclass(frozen=True)
class Ordered:
    """A task that is handed out.

    task: the picture to make
    written: time at which the output file was last written before the task was handed out [ns]; 0 if there was no file
    """

    task: Task
    written: int


@dataclass(frozen=True)
class Parcel:
    """The pictures of one dask task.

    future: the dask task
    orders: the pictures
    alone: True if no other parcel of the batch runs at the same time
    """

    future: distributed.Future[Any]
    orders: tuple[Ordered, ...]
    alone: bool


def _sendable() -> Any:
    """Returns a function that calls `make`. It is a local function, so dask pickles it by value.

    A worker without glshade would die while it unpickles `make` itself. It can unpickle the local function. When it calls that
    function, the import of `make` fails, and dask reports the error.
    """

    def imported(*arguments: Any) -> Any:
        from glshade.batch.parcel import make

        return make(*arguments)

    return imported


class Cluster:
    """The workers of a scheduler, or workers on this machine, which the constructor starts. This class is a context manager.

    address: address of a scheduler, or "local"
    devices: EGL device of each local worker, None if the driver chooses. With a scheduler, only the first device counts: it is
        for workers whose environment has no GLSHADE_DEVICE
    backend: OpenGL backend, as for Renderer
    reference: True if the float64 reference draws
    hardware: True if the devices of local workers are GPUs
    shares: True if local workers share the cores for drawing
    shaders: the user's own shader folders
    models: the user's own model folders
    retries: number of times that a picture is made again after its worker died
    Errors: MissingLibrary; ValueError for an address; GlshadeError if no scheduler answers or none can be started.
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
        shaders: Sequence[str] = (),
        models: Sequence[str] = (),
        retries: int = RETRIES,
    ) -> None:
        check_address(address)
        try:
            import distributed
        except ImportError:
            raise MissingLibrary("--cluster needs dask.distributed: pip install 'glshade[dist]'") from None
        # dask would log every fault several times, so its logs are turned off. This class reports each fault once.
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self.address = address
        self.driver = ""
        self._drivers: set[str] = set()
        self._retries = retries
        self._local = _started(devices, hardware, shares) if address == LOCAL else None
        self._conditions: Conditions = {
            "code": code_digest(shaders),
            "backend": backend,
            "device": None if self._local else devices[0],
            "shaders": list(map(os.path.abspath, shaders)),
            "models": list(map(os.path.abspath, models)),
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
        # Key of a dask task -> parcel, for parcels that are handed out; and the keys of dask tasks that are finished.
        self._flight: dict[str, Parcel] = {}
        self._arrived: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._waiting: Iterator[Task] = iter(())
        # Pictures whose worker died. Each of them is made again while nothing else of the batch runs.
        self._suspects: deque[Ordered] = deque()
        # Task number -> number of workers that died while they made it.
        self._deaths: dict[int, int] = {}
        # Output files of the parcels whose workers died. Incomplete temporary files may lie beside them.
        self._spoiled: list[str] = []
        # Workers that died before they could draw.
        self._stillborn = 0
        # Time for one picture in the latest parcel [s], and number of pictures in the next parcel.
        self._each, self._size = 0.0, 1
        # Time at which the workers were last counted, and time at which there last was a worker, both by `monotonic` [s].
        self._counted = self._seen = monotonic()
        self.jobs, self._resources = 0, dict[str, float]()
        self._stopping = self._lonely = False
        self._count()

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Ends local workers and removes their incomplete files. Workers of a scheduler only release their contexts."""
        outputs = [order.task.output for parcel in self._flight.values() for order in parcel.orders]
        if self._local is None and not outputs and self.driver and self._client.status == "running":
            self._client.run(forget, on_error="ignore")
        self._client.close(timeout=CONNECTING)
        if self._local is not None:
            self._close_local(at_once=bool(outputs))
            # Only now have all processes ended. Before, `remove` would have left the files of running processes alone.
            leftovers.remove([*outputs, *self._spoiled])

    def stop(self) -> None:
        """Stops handing out tasks. The tasks that are handed out already are finished."""
        self._stopping = True

    def ready(self) -> str:
        """Waits for the first worker, and returns the name of its driver. Errors: as for `records`."""
        with interrupts(self.stop) as interrupted:
            self._send(())
            while not self.driver and not self._stopping:
                for _ in self._listen():
                    pass
        if interrupted:
            raise KeyboardInterrupt
        self._count()
        return self.driver

    def records(self, tasks: Iterable[Task]) -> Iterator[Record]:
        """Yields the tasks' records, in the order in which the parcels are finished.

        Errors: ContextError if a worker cannot draw; GlshadeError if the scheduler is lost, or if a worker's glshade differs;
        KeyboardInterrupt after Ctrl-C, once the tasks that are handed out are finished. A second Ctrl-C raises it at once.
        """
        self._waiting = iter(tasks)
        with interrupts(self.stop) as interrupted:
            while self._feed():
                yield from self._listen()
        if interrupted:
            raise KeyboardInterrupt

    def _feed(self) -> bool:
        """Hands out tasks until the workers have no room for more. Returns whether further records will come."""
        room = (1 if self._each > SLOW else AHEAD) * max(self.jobs, 1)
        while not self._stopping and len(self._flight) < room:
            tasks = [*islice(self._waiting, self._size)]
            if not tasks:
                break
            self._send([Ordered(task, time_written(task.output)) for task in tasks])
        if self._suspects and not self._flight and not self._stopping:
            # The suspect runs alone: if its worker dies again, this picture is certainly the cause.
            self._send([self._suspects.popleft()], alone=True)
        return bool(self._flight)

    def _send(self, orders: Sequence[Ordered], alone: bool = False) -> None:
        """Submits a parcel. A parcel without pictures only asks for the name of a worker's driver."""
        self._sent += 1
        key = f"{self._name}-{self._sent}"
        future = self._client.submit(
            _sendable(),
            [(order.task.absolute().as_dict(), order.written) for order in orders],
            {**self._conditions},
            key=key,
            resources=self._resources or None,
            pure=False,
        )
        self._flight[key] = Parcel(future, tuple(orders), alone)
        future.add_done_callback(lambda future: self._arrived.put(future.key))

    def _listen(self) -> Iterator[Record]:
        """Waits up to GLANCE for a finished parcel, and yields its records."""
        try:
            parcel = self._flight.pop(self._arrived.get(timeout=GLANCE))
        except queue.Empty:
            self._look()
            return
        yield from self._records(parcel)
        if monotonic() > self._counted + COUNTING:
            self._count()

    def _records(self, parcel: Parcel) -> Iterator[Record]:
        """Yields the records of a finished parcel, or handles its failure. Errors: as for `records`."""
        from distributed import KilledWorker

        try:
            result = parcel.future.result()
        except KilledWorker as error:
            yield from self._killed(parcel, error)
        except GlshadeError as error:
            # The traceback through dask's code would not help the user.
            raise error.with_traceback(None) from None
        except (CancelledError, OSError, TimeoutError):
            self._raise_lost()
        except (ImportError, RuntimeError) as error:
            raise GlshadeError(
                f"a worker of {self.address} cannot run glshade {__version__}: {_one_line(error)}; "
                "install the same version there"
            ) from None
        else:
            yield from self._finished(parcel, result)

    def _finished(self, parcel: Parcel, result: dict[str, Any]) -> Iterator[Record]:
        """Yields the records of a parcel that `make` has made, and sets the size of the next one."""
        self._seen = monotonic()
        driver = result["driver"]
        self.driver = self.driver or driver
        if driver not in self._drivers and self._drivers:
            warnings.warn(
                f"the workers have different drivers, whose pictures may differ; another one is {driver}", stacklevel=2
            )
        self._drivers.add(driver)
        if parcel.orders:
            self._each = result["seconds"] / len(parcel.orders)
            # The size grows slowly, because the first picture of a worker or of a scene takes longer than the others.
            self._size = max(1, min(2 * self._size, PARCEL_PICTURES, int(PARCEL_SECONDS / max(self._each, 1e-6))))
        for order, data in zip(parcel.orders, result["records"], strict=True):
            attempts = self._deaths.pop(order.task.number, 0) + 1
            yield replace(Record.from_dict(data), output=order.task.output, attempts=attempts)

    def _killed(self, parcel: Parcel, error: distributed.KilledWorker) -> Iterator[Record]:
        """Handles a parcel that killed its workers, and yields the records of pictures that have no retries left.

        The other pictures are made again, one at a time while nothing else runs. So it becomes certain which of them kills its
        worker.
        """
        deaths = error.allowed_failures + 1
        if not parcel.orders:
            self._stillborn += deaths
            if self._stillborn > self._retries:
                raise ContextError(f"the driver ends the process that opens it: {self._stillborn} workers died")
            self._send(())
        self._spoiled.extend(order.task.output for order in parcel.orders)
        for order in parcel.orders:
            number, output = order.task.number, order.task.output
            self._deaths[number] = self._deaths.get(number, 0) + deaths
            if parcel.alone and self._deaths[number] > self._retries:
                attempts = self._deaths.pop(number)
                message = f"{output}: the worker that drew it died, {attempts} times: the driver crashed, or memory ran out"
                yield Record(number, output, "failed", attempts=attempts, error=message, exit_code=1)
            else:
                self._suspects.append(order)

    def _look(self) -> None:
        """Checks that the scheduler is connected and has workers, after a wait in which no parcel was finished.

        Errors: GlshadeError.
        """
        if self._client.status not in {"running", "connecting"}:
            self._raise_lost()
        if monotonic() > self._counted + COUNTING:
            self._count()
        if self.jobs:
            self._seen = monotonic()
        elif monotonic() > self._seen + LONELY and not self._lonely:
            if self._local is not None:
                raise GlshadeError(f"no worker process could be kept running on this machine for {LONELY:.0f} s")
            self._lonely = True
            warnings.warn(f"the scheduler at {self.address} has no workers; waiting for the first one", stacklevel=2)

    def _count(self) -> None:
        """Counts the workers. If some declare a GPU, only those are counted, and parcels require the resource."""
        try:
            workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
        except (OSError, TimeoutError):
            self._raise_lost()
        with_gpu = [worker for worker in workers if worker["resources"].get(GPU, 0) >= 1]
        self.jobs, self._resources = len(with_gpu or workers), {GPU: 1.0} if with_gpu else {}
        self._conditions["hardware"] = bool(with_gpu) and not self._conditions["reference"]
        self._counted = monotonic()

    def _raise_lost(self) -> None:
        """Raises the error of a lost scheduler. Errors: GlshadeError, always."""
        raise GlshadeError(
            f"the scheduler at {self.address} is lost; finished pictures are kept: continue with --resume when it is back"
        ) from None

    def _close_local(self, at_once: bool = False) -> None:
        """Ends the local cluster, if there is one. at_once: True kills the workers instead of waiting for their pictures."""
        if self._local is None:
            return
        if at_once:
            # `close` would wait for the workers that draw.
            for worker in self._local.workers.values():
                process = worker.process and worker.process.process
                if process is not None:
                    worker.auto_restart = False
                    os.kill(process.pid, signal.SIGKILL)
        self._local.close(timeout=CONNECTING)


def _started(devices: Sequence[int | None], hardware: bool, shares: bool) -> distributed.SpecCluster:
    """Starts a scheduler in this process, and a worker process for each device.

    dask's LocalCluster cannot be used here, because all its workers have the same environment variables.
    Errors: GlshadeError if they cannot be started.
    """
    import dask
    from distributed import Nanny, Scheduler, SpecCluster

    host = "127.0.0.1"
    # Without LP_NUM_THREADS, llvmpipe would start a thread for every core in every worker.
    common = {"LP_NUM_THREADS": os.environ.get("LP_NUM_THREADS", "0")} if shares else {}
    workers = {
        number: {
            "cls": Nanny,
            "options": {
                "host": host,
                "nthreads": 1,
                "resources": {GPU: 1} if hardware else {},
                # 0 means no limit. With a limit, dask would pause or kill workers for memory of the driver that dask cannot
                # free.
                "memory_limit": 0,
                "dashboard": False,
                "env": common if device is None else {**common, DEVICE: str(device)},
                "preload": ["glshade.batch.parcel"],
            },
        }
        for number, device in enumerate(devices)
    }
    # allowed_failures 0: the Cluster handles a parcel after one death of its worker. worker-ttl None: a worker that draws may
    # not answer for minutes. Port 0 for the HTTP server: a second cluster on this machine would warn that the default is taken.
    free = {"port": 0, "dashboard_address": f"{host}:0"}
    options = {"host": host, **free, "dashboard": False, "allowed_failures": 0}
    quiet = {"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical"}
    # Without routes, the HTTP servers have no pages: `"dashboard": False` alone would leave pages with the tasks' arguments.
    unseen: dict[str, Any] = {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
    with dask.config.set({"distributed.scheduler.worker-ttl": None, **quiet, **unseen}):
        try:
            return SpecCluster(workers=workers, scheduler={"cls": Scheduler, "options": options})
        except (OSError, RuntimeError) as error:
            raise GlshadeError(f"no workers can be started on this machine: {_one_line(error)}") from None


def _one_line(error: BaseException) -> str:
    """Returns an error's message on one line, or the name of its class if it has none."""
    return "; ".join(line.strip() for line in str(error).splitlines() if line.strip()) or type(error).__name__
