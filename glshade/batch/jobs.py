"""Jobs: chooses the number of worker processes of a batch, and their devices."""

from __future__ import annotations

import os
from itertools import cycle, islice
from pathlib import Path

# One worker is started for this many pictures. More workers would not pay: to start one takes half a second of a core.
WORTH = 4
# Device files of GPU drivers. If none of them exists, there is no GPU. EGL is then not asked for devices, which takes 80 ms.
NODES = ("/dev/dri", "/dev/nvidiactl", "/dev/dxg")


def cores() -> int:
    """Returns the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def gpus() -> list[int]:
    """Returns the indices of the EGL devices that are hardware. Errors: ContextError."""
    if not any(Path(node).exists() for node in NODES):
        return []
    from glshade.gl.context import devices

    return [device.index for device in devices() if not device.is_software]


def devices(jobs: int | None, pictures: int, on: list[int]) -> list[int | None]:
    """Returns the EGL device of each worker; None leaves the choice to the driver.

    jobs: number of workers; None starts one for each device of `on` or, without devices, one for each core
    pictures: number of pictures to make, which limits the default number of workers
    on: EGL devices, which the workers take in turn; empty if the CPU draws
    """
    if jobs is None:
        jobs = min(len(on), pictures) if on else min(cores(), -(-pictures // WORTH))
    return list(islice(cycle(on or (None,)), max(jobs, 1)))
