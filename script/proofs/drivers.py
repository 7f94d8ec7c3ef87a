"""drivers: the shipped scenes are verified at every rate with every driver of script/drivers.

An input is a scene, a rate and a driver. A proof of few inputs uses the first two drivers only, which need no download.
"""

from __future__ import annotations

import random

from drivers import DRIVERS, TASKS, WIDTH, UnavailableError, verify_with

COUNT = len(DRIVERS) * len(TASKS)


def prove(count: int, seed: int) -> int:
    """Verifies scenes with drivers, and returns the number of pictures that are not verified."""
    tasks = random.Random(seed).sample(TASKS, len(TASKS))
    names = list(DRIVERS)[: max(2, -(-count // len(tasks)))]
    broken = 0
    for number, name in enumerate(names):
        share = tasks[: len(range(number, count, len(names)))]
        try:
            rows = verify_with(DRIVERS[name], share, WIDTH) if share else []
        except UnavailableError as error:
            print(f"{name}: not available: {error}")
            continue
        wrong = [row for row in rows if row.verdict != "verified"]
        print(f"{name}: {len(rows) - len(wrong)} of {len(rows)} pictures verified")
        for row in wrong:
            print(f"{name}: {row.task.scene}, {row.task.rate}: {row.verdict}, {row.unexplained} pixels unexplained")
        broken += len(wrong)
    return broken
