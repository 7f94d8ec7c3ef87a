"""Worker: runs one program in a process of its own, so that the programs' drivers do not influence each other.

    python -m glshade.bench.worker NAME serve STAGE           draws on request, by lines on stdin (see `serve`)
    python -m glshade.bench.worker NAME files STAGE FOLDER    writes the frames 0001.png ..., and reports the time [s]
    python -m glshade.bench.worker NAME cold STAGE PICTURE    writes one picture

The programs measure their own time, so that the time for the pipe is not included. This module imports little at its start,
because the time of `cold` includes its imports.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

from glshade.bench.stage import EYE, WorkFiles, eye
from glshade.bench.works import GLSHADE

# Smallest total time of the frames of one measurement [s].
LEAST = 0.3


def program(name: str, stage: WorkFiles) -> Any:
    """Returns the program, ready to draw a stage."""
    module = "glshade.bench.own" if name == GLSHADE else f"glshade.bench.peers.{name}"
    return importlib.import_module(module).Peer(stage)


def files(drawer: Any, count: int, folder: str) -> float:
    """Writes frames to a folder, and returns the time from the start of the first frame to the end of the last [s].

    Another frame is drawn before the first one and not written, so that the program's preparations are not counted.
    """
    drawer.frame(EYE)
    start = perf_counter()
    for frame in range(1, count + 1):
        drawer.save(eye(frame), f"{folder}/{frame:04d}.png")
    return perf_counter() - start


def draws(draw: Callable[[], Any], count: int) -> list[float]:
    """Draws frames repeatedly, and returns the time of each [s].

    The first frame is not counted, because other programs have used the CPU's caches since this program's last round. At least
    `count` frames are counted, and as many as it takes for all frames together to last LEAST. So a short load of the machine
    does not change the median.
    """
    times: list[float] = []
    while len(times) <= count or sum(times) < LEAST:
        start = perf_counter()
        draw()
        times.append(perf_counter() - start)
    return times[1:]


def own_peak() -> int:
    """Returns the largest resident memory that this process has had [bytes].

    Linux's VmHWM begins anew with each program that a process becomes; getrusage counts what the process had before, too.
    """
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    # The line reads "VmHWM:  123456 kB".
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:"))


def serve(drawer: Any, answer: Any) -> None:
    """Answers each line of stdin, one JSON value a line.

    A number asks for that many frames; the answer is the time of each [s]. "peak" asks for the largest memory of the process
    so far [bytes]. Another string is the path of an .npy file, to which the picture is written; the answer is the path.
    """
    import numpy as np

    answer({"driver": drawer.driver})
    for line in sys.stdin:
        request = json.loads(line)
        if request == "peak":
            answer(own_peak())
        elif isinstance(request, str):
            np.save(request, drawer.frame(EYE))
            answer(request)
        else:
            answer(draws(lambda: drawer.frame(EYE), request))


def main(name: str, verb: str, stage_path: str, *targets: str) -> None:
    """Runs a program; the module's docstring lists the arguments."""
    # Drivers and libraries print to stdout. Answers have a file descriptor of their own, so that such text cannot corrupt them.
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def answer(value: Any) -> None:
        print(json.dumps(value), file=out, flush=True)

    stage = WorkFiles.load(stage_path)
    drawer = program(name, stage)
    if verb == "serve":
        serve(drawer, answer)
    elif verb == "files":
        Path(targets[0]).mkdir(parents=True, exist_ok=True)
        answer({"driver": drawer.driver, "seconds_pictures": files(drawer, stage.frames, targets[0])})
    else:
        drawer.save(EYE, targets[0])


if __name__ == "__main__":
    main(*sys.argv[1:])
