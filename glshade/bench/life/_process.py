"""Process: runs one program of a work in a process of its own.

python -m glshade.bench.life._process WORK PROGRAM SIZE FOLDER serve            answers by lines on stdin (see `serve`)
python -m glshade.bench.life._process WORK PROGRAM SIZE FOLDER once PICTURE     draws one picture and writes it as .npy
"""

from __future__ import annotations

import importlib
import json
import os
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from glshade.bench.worker import LEAST, own_peak

# No further picture is begun once the pictures of one answer have taken this long together [s].
MOST = 1.5


class Clocked:
    """A program, and the last of its pictures."""

    def __init__(self, program: Any) -> None:
        self.program, self._number = program, -1
        self._pixels: Any = None

    def draw(self, number: int) -> float:
        """Draws a picture and returns the time [s], without that of the preparation."""
        prepared = self.program.prepare(number)
        start = perf_counter()
        self._pixels = self.program.draw(prepared)
        seconds = perf_counter() - start
        self._number = number
        return seconds

    def several(self, count: int) -> list[float]:
        """Draws new pictures and returns the time of each [s].

        The first picture is not counted, because other programs have used the CPU's caches since the last round. At least
        `count` pictures are counted, and as many as it takes for all together to last LEAST; but none is begun after MOST. If
        that leaves the first alone, it counts: so long a picture suffers little from empty caches.
        """
        times: list[float] = []
        while (len(times) <= count or sum(times) < LEAST) and sum(times) <= MOST:
            times.append(self.draw(self._number + 1))
        return times[1:] or times

    def picture(self) -> Any:
        """Returns picture 0, (H, W, C); several pictures are put one below the other. It is the same for all programs."""
        if self._number != 0:
            self.draw(0)
        return self._pixels.reshape(-1, *self._pixels.shape[-2:])


def serve(clocked: Clocked, answer: Any) -> None:
    """Answers each line of stdin, one JSON value a line.

    "first" asks for picture 0, and a number for so many new pictures; the answer is the time of each [s]. "peak" asks for the
    largest memory of the process so far [bytes]. Another string is the path of an .npy file, to which picture 0 is written; the
    answer is the name of the driver.
    """
    answer({})
    for line in sys.stdin:
        request = json.loads(line)
        if request == "first":
            answer([clocked.draw(0)])
        elif request == "peak":
            answer(own_peak())
        elif isinstance(request, str):
            np.save(request, clocked.picture())
            answer(clocked.program.driver)
        else:
            answer(clocked.several(request))


def main(module: str, work: str, program: str, size: str, folder: str, verb: str, *targets: str) -> None:
    """Runs a program; the module's docstring lists the arguments."""
    # Drivers and libraries print to stdout. Answers have a file descriptor of their own, so that such text cannot corrupt them.
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    programs = importlib.import_module(f"glshade.bench.life.{module}").WORKS[work].programs
    clocked = Clocked(programs[program](int(size), Path(folder)))
    if verb == "serve":
        serve(clocked, lambda value: print(json.dumps(value), file=out, flush=True))
    else:
        np.save(targets[0], clocked.picture())
        # The process ends without the shutdown of interpreter and driver, as the command glshade does.
        os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
