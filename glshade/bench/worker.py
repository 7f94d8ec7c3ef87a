"""A program in a process of its own, so that drivers and their state do not mix.

    python -m glshade.bench.worker NAME serve STAGE           draws when told to, by lines on stdin (`Worker` speaks them)
    python -m glshade.bench.worker NAME files STAGE FOLDER    writes the frames 0001.png ..., and says what that took [s]
    python -m glshade.bench.worker NAME cold STAGE PICTURE    writes one picture, and that is all

The programs time themselves: what the pipe costs is nobody's. Nothing is imported here that a cold start would pay for.
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

from glshade.bench.stage import EYE, Stage, eye
from glshade.bench.works import GLSHADE

# [s]
LEAST = 0.3


def program(name: str, stage: Stage) -> Any:
    """The program, ready to draw."""
    module = "glshade.bench.own" if name == GLSHADE else f"glshade.bench.peers.{name}"
    return importlib.import_module(module).Peer(stage)


def files(drawer: Any, count: int, folder: str) -> float:
    """Writes the frames; seconds from the start of the first to the end of the last, after one that is not written."""
    drawer.frame(EYE)
    start = perf_counter()
    for frame in range(1, count + 1):
        drawer.save(eye(frame), f"{folder}/{frame:04d}.png")
    return perf_counter() - start


def draws(draw: Callable[[], Any], count: int) -> list[float]:
    """Seconds of each frame, after one that is not counted: others have used the caches in the meantime.

    count: at least; short frames are drawn until it is LEAST, so that one hiccup of the machine is not the median.
    """
    found: list[float] = []
    while len(found) <= count or sum(found) < LEAST:
        start = perf_counter()
        draw()
        found.append(perf_counter() - start)
    return found[1:]


def serve(drawer: Any, answer: Any) -> None:
    """Answers each line of stdin by a line: a number of frames by their seconds, a path by writing the picture there (.npy)."""
    import numpy as np

    answer({"driver": drawer.driver})
    for line in sys.stdin:
        asked = json.loads(line)
        if isinstance(asked, str):
            np.save(asked, drawer.frame(EYE))
            answer(asked)
        else:
            answer(draws(lambda: drawer.frame(EYE), asked))


def main(name: str, verb: str, stage_path: str, *where: str) -> None:
    # Drivers and libraries print: stdout is for the answers alone.
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def answer(said: Any) -> None:
        print(json.dumps(said), file=out, flush=True)

    stage = Stage.load(stage_path)
    drawer = program(name, stage)
    if verb == "serve":
        serve(drawer, answer)
    elif verb == "files":
        Path(where[0]).mkdir(parents=True, exist_ok=True)
        answer({"driver": drawer.driver, "seconds_pictures": files(drawer, stage.frames, where[0])})
    else:
        drawer.save(EYE, where[0])


if __name__ == "__main__":
    main(*sys.argv[1:])
