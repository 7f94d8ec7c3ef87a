"""Jobs: how many worker processes a batch has, and on which devices."""

from __future__ import annotations

import os
from itertools import cycle, islice
from pathlib import Path

# A further worker takes about half a second of a core to start, and so pays for a few pictures at least.
WORTH = 4
# Without one of these, Linux has no driver for a GPU, and asking EGL for it would take 80 ms.
NODES = ("/dev/dri", "/dev/nvidiactl", "/dev/dxg")


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def gpus() -> list[int]:
    """EGL's devices that are not the CPU. Errors: ContextError."""
    if not any(Path(node).exists() for node in NODES):
        return []
    from glshade.gl.context import devices

    return [device.index for device in devices() if not device.is_software]


def devices(jobs: int | None, pictures: int, on: list[int]) -> list[int | None]:
    """The EGL device of each worker, None for the driver's own choice.

    jobs: how many, where that is said. on: the devices to share, in turn; one worker each. Without any, the CPU draws: with a
    worker a core.
    """
    if jobs is None:
        jobs = min(len(on), pictures) if on else min(cores(), -(-pictures // WORTH))
    return list(islice(cycle(on or (None,)), max(jobs, 1)))
