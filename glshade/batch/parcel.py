"""Parcel: makes the pictures of one dask task in a worker of a cluster."""

from __future__ import annotations

import json
import os
import signal
import socket
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from time import perf_counter
from typing import Any, TypedDict

from glshade.batch.engine import WRITERS, fault
from glshade.batch.maker import Drawn, Maker
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import ContextError, GlshadeError, SceneError, ShaderError
from glshade.version import __version__

# Environment variable of a worker: the index of the EGL device on which it draws.
DEVICE = "GLSHADE_DEVICE"


class Conditions(TypedDict):
    """The conditions that all pictures of a batch have in common.

    code: digest of the client's code, as `code_digest` returns it
    backend: OpenGL backend, as for Maker
    device: EGL device for workers without GLSHADE_DEVICE; None if the driver chooses
    shaders: absolute paths of the user's shader folders
    models: absolute paths of the user's model folders
    reference: True if the float64 reference draws
    hardware: True if only a GPU may draw
    """

    code: str
    backend: str
    device: int | None
    shaders: list[str]
    models: list[str]
    reference: bool
    hardware: bool


@cache
def _thread() -> ThreadPoolExecutor:
    """Returns an executor with the only thread of this process that draws.

    An OpenGL context belongs to one thread, and a dask worker may have several threads.
    """
    return ThreadPoolExecutor(1, thread_name_prefix="glshade")


# The Makers of this process, by their arguments as JSON.
_makers: dict[str, Maker] = {}


def make(orders: Sequence[tuple[dict[str, Any], int]], conditions: Conditions) -> dict[str, Any]:
    """Makes a parcel's pictures, in a worker.

    orders: (Task.as_dict(), Ordered.written) of each picture
    conditions: the conditions of the batch
    Returns {"driver": name, "seconds": time of the parcel [s], "records": Record.as_dict() of each picture}.
    Errors: ContextError if no driver can draw; GlshadeError if this glshade differs from the client's.
    """
    return _thread().submit(_make_on_this_thread, orders, conditions).result()


def _make_on_this_thread(orders: Sequence[tuple[dict[str, Any], int]], conditions: Conditions) -> dict[str, Any]:
    host = socket.gethostname()
    maker = _maker_for(conditions, host)
    driver = _driver_for(conditions, maker, host)
    start = perf_counter()
    records: list[Future[Record]] = []
    with ThreadPoolExecutor(WRITERS) as writers:
        for data, written in orders:
            if len(records) > WRITERS:
                # One picture is drawn while each writer writes one. More pictures in memory would save no time.
                records[-WRITERS - 1].result()
            task = Task.from_dict(data)
            try:
                drawn: Drawn | Record = maker.draw(replace(task, resume=task.resume or time_written(task.output) != written))
            except Exception as error:
                drawn = fault(task.number, task.output, error)
            records.append(writers.submit(_write, drawn, task.resume))
    results = [record.result().as_dict() for record in records]
    return {"driver": driver, "seconds": perf_counter() - start, "records": results}


def _maker_for(conditions: Conditions, host: str) -> Maker:
    """Returns this process's Maker for the conditions. Errors: GlshadeError if this glshade differs from the client's."""
    device = int(os.environ.get(DEVICE, -1))
    arguments: dict[str, Any] = {
        "backend": conditions["backend"],
        "device": conditions["device"] if device < 0 else device,
        "shaders": conditions["shaders"],
        "models": conditions["models"],
    }
    key = json.dumps(arguments)
    try:
        maker = _makers.get(key) or _makers.setdefault(key, Maker(**arguments))
        code = maker.code
    except (SceneError, ShaderError) as error:
        raise GlshadeError(f"the worker on {host}: {error}") from None
    if code != conditions["code"]:
        raise GlshadeError(
            f"the worker on {host} has another glshade (version {__version__}), other shaders, other models or another "
            "OpenImageIO than this command: install the same everywhere, and start the workers again"
        )
    return maker


def _driver_for(conditions: Conditions, maker: Maker, host: str) -> str:
    """Returns the name of the driver. Errors: ContextError if none can draw, or if a GPU is required and the CPU draws."""
    try:
        driver = "float64 reference" if conditions["reference"] else maker.driver
    except ContextError as error:
        raise ContextError(f"the worker on {host}: {error}") from None
    if conditions["hardware"] and maker.renderer.context.is_software:
        device = "the driver's own choice" if maker.device is None else f"EGL device {maker.device}"
        raise ContextError(f"the worker on {host} has a GPU, but {device} draws on the CPU: {driver}; see {DEVICE}")
    return driver


def _write(drawn: Drawn | Record, resume: bool) -> Record:
    """Writes a picture if there is one to write, and returns its record. resume: Task.resume."""
    if isinstance(drawn, Record):
        return drawn
    try:
        record = drawn.write()
    except Exception as error:
        return fault(drawn.record.number, drawn.record.output, error)
    # Without Task.resume, a picture is there already only if the worker that made it died before it could report it.
    return replace(record, state="done") if record.state == "skipped" and not resume else record


def forget() -> None:
    """Releases the contexts of this process once its current parcel is done."""

    def close() -> None:
        for maker in _makers.values():
            maker.close()
        _makers.clear()

    _thread().submit(close)


def time_written(output: str) -> int:
    """Returns the time at which the file was last written [ns], or 0 if the file does not exist."""
    try:
        return os.stat(output).st_mtime_ns
    except OSError:
        return 0


def dask_setup(worker: Any) -> None:
    """Prepares a worker of a local cluster; dask calls it on the worker's main thread.

    The worker ignores Ctrl-C, which the client handles, and leaves stdout to the client.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Drivers print to stdout, where the client prints the paths of pictures.
    os.dup2(2, 1)
