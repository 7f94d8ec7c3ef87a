"""Process: the plugin's state in one process of a run, and the counts that the processes tell each other."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import pytest

from glshade.golden.pytest_plugin.settings import Settings, read_settings


@dataclass
class Counts:
    """What a process tells at its end. With pytest-xdist, the controller adds up those of the workers.

    written: the paths of the baselines that --glshade-update has written.
    ready_made: number of pictures that tests handed over ready-made, so that --glshade-stability could not draw them again.
    left_out: number of tests that were deselected, and of files that were not collected.
    unfinished: number of tests with baselines that failed, or that were skipped before they had used one.
    """

    written: list[str] = field(default_factory=list)
    ready_made: int = 0
    left_out: int = 0
    unfinished: int = 0


@dataclass
class Process:
    """The plugin's state in one process.

    settings: the plugin's settings.
    run: the name of the run, the same in all of its processes.
    worker: the name of this worker of pytest-xdist; empty in other processes.
    counts: what this process tells at its end.
    users: the node ids of the tests that have used a baseline in this process.
    active: the Run; None until a test uses the plugin. Its type is left open, because its module imports this one.
    lost: whether a worker has ended without telling its counts.
    lines: what is printed at the end of the run, and whether it says why the run fails.
    """

    settings: Settings
    run: str
    worker: str
    counts: Counts = field(default_factory=Counts)
    users: set[str] = field(default_factory=set)
    active: Any = None
    lost: bool = False
    lines: list[tuple[str, bool]] = field(default_factory=list)

    def used(self) -> bool:
        """Returns whether any process of the run has written results."""
        return any((self.settings.results / "lines").glob(f"{self.run}.*"))

    def add(self, counts: dict[str, Any] | None, lost: bool) -> None:
        """Adds the counts of a worker.

        counts: in the form of `vars`; None for a worker that has none, because no test used the plugin or it was lost.
        lost: whether the worker was lost.
        """
        self.lost |= lost
        if counts is None:
            return
        self.counts.written += counts["written"]
        self.counts.ready_made += counts["ready_made"]
        self.counts.unfinished += counts["unfinished"]
        # Every worker collects all tests, and leaves out the same ones.
        self.counts.left_out = max(self.counts.left_out, counts["left_out"])


def start(config: pytest.Config) -> Process:
    """Returns the state of a process. Errors: pytest.UsageError for an option with a bad value."""
    # pytest-xdist gives each worker this attribute; `pytest_configure_node` puts the run's name into it.
    given: dict[str, Any] = getattr(config, "workerinput", {})
    return Process(read_settings(config), given.get("glshade_run") or os.urandom(8).hex(), given.get("workerid", ""))
