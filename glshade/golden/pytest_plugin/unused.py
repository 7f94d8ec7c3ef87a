"""Unused baselines: those that no test of a whole run has used, for --glshade-disallow-unused."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from typing import TYPE_CHECKING

import pytest

from glshade.golden.pytest_plugin.process import Process

if TYPE_CHECKING:
    from glshade.golden.results import Case

# At most this many names are printed.
MOST_NAMES = 20


class Watcher:
    """Counts the tests that do not run, or do not get to their end. It is registered only with --glshade-disallow-unused."""

    def __init__(self, process: Process) -> None:
        self._process = process

    def pytest_deselected(self, items: Iterable[pytest.Item]) -> None:
        """Counts tests that were deselected."""
        self._process.counts.left_out += len(list(items))

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Counts files and classes whose tests are not known, because they failed or were skipped."""
        self._process.counts.left_out += not report.passed

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Counts tests with baselines that do not get to their end."""
        report = yield
        if "render_regression" in getattr(item, "fixturenames", ()):
            used = item.nodeid in self._process.users
            self._process.counts.unfinished += report.failed or (report.skipped and not used)
        return report


def find_unused(session: pytest.Session, process: Process, cases: Iterable[Case]) -> tuple[str, bool]:
    """Returns a line about the baselines that no case names, and whether it fails the run; an empty line if all are used.

    Only a run of the whole suite tells. Errors: GlshadeError where the folder of baselines cannot be listed.
    """
    reason = _partial(session, process)
    if reason:
        return f"glshade: unused baselines were not looked for: {reason}", False
    from glshade.golden.baselines import Baselines

    names = sorted(set(Baselines(process.settings.baselines).names()) - {case.name for case in cases})
    if not names:
        return "", False
    listed = ", ".join(names[:MOST_NAMES]) + (f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else "")
    return f"glshade: no test uses these baselines in {process.settings.baselines}; delete them: {listed}", True


def _partial(session: pytest.Session, process: Process) -> str:
    """Returns why the run is not one of the whole suite; empty if it is one."""
    config, counts = session.config, process.counts
    if config.getoption("collectonly") or config.getoption("setuponly") or config.getoption("setupplan"):
        return "no test ran"
    if counts.left_out or any(config.getoption(name, None) for name in ("ignore", "ignore_glob", "lf")):
        return "only some tests ran, as others were deselected, ignored or not collected"
    if not _names_all(config):
        return "only some tests were named on the command line"
    if process.lost or session.shouldstop or session.shouldfail:
        return "the run ended early"
    if session.exitstatus not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        return "the run ended early"
    if counts.unfinished:
        return f"{counts.unfinished} of the tests with baselines failed or were skipped"
    return ""


def _names_all(config: pytest.Config) -> bool:
    """Returns whether the files and folders that pytest was given contain the whole suite.

    The whole suite is what `testpaths` names in pytest's configuration file, and else the root folder.
    """
    given = [config.invocation_params.dir / argument for argument in config.args if "::" not in argument]
    suite = [path for text in config.getini("testpaths") for path in config.rootpath.glob(text)] or [config.rootpath]
    return all(any(path.resolve().is_relative_to(folder.resolve()) for folder in given) for path in suite)
