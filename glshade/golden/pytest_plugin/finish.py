"""Finish: the end of a run, at which one process writes the summaries of all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from glshade.errors import GlshadeError, printable
from glshade.golden.pytest_plugin.process import Process
from glshade.golden.pytest_plugin.unused import find_unused
from glshade.golden.results import Case, ResultsWriter

if TYPE_CHECKING:
    from glshade.golden.result import Result


def finish_run(session: pytest.Session, process: Process) -> None:
    """Writes the summaries, and collects the lines to print. The run fails if that fails, or if baselines are unused."""
    try:
        cases = _written(process) if process.used() else []
        if process.settings.disallow_unused:
            text, fails = find_unused(session, process, cases)
            process.lines += [(text, fails)] if text else []
    except (GlshadeError, OSError) as error:
        process.lines.append((f"glshade: {printable(str(error))}", True))
    if any(fails for _, fails in process.lines) and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _written(process: Process) -> list[Case]:
    """Writes the summaries of a run, and returns its cases. Errors: GlshadeError, OSError."""
    settings, counts = process.settings, process.counts
    cases = ResultsWriter(settings.results, process.run).finish()
    files = [settings.results / "results.json"]
    if "junit" in settings.summary:
        files.insert(0, _junit(settings.results, cases))
    if "html" in settings.summary:
        from glshade.golden.page import write_page

        files.insert(0, write_page(settings.results, cases))
    failed = sum(not case.passed for case in cases)
    lines = [f"{_counted(len(cases), 'picture')} compared, {failed} failed; see {files[0]}"]
    if counts.written:
        lines.append(f"{_counted(len(counts.written), 'baseline')} written in {settings.baselines}")
    if settings.update_refused:
        lines.append("no baseline was updated, because the environment variable CI is set; add --glshade-force to do it")
    if counts.ready_made:
        lines.append(f"{_counted(counts.ready_made, 'picture')} given ready-made, which --glshade-stability cannot draw again")
    process.lines += [(f"glshade: {line}", False) for line in lines]
    return cases


def _junit(folder: Path, cases: Sequence[Case]) -> Path:
    """Writes the cases as JUnit's XML. Errors: GlshadeError."""
    from glshade.golden.report import write_junit

    path = folder / "junit.xml"
    write_junit(path, [_result(case) for case in cases])
    return path


def _result(case: Case) -> Result:
    """Returns the result of a case, without its layers."""
    from glshade.golden.result import Cause, Outcome, Result, SceneVerdict

    return Result(
        case.name,
        case.baseline or case.name,
        Outcome[case.outcome.upper()],
        case.reason,
        verdict=SceneVerdict(case.verdict) if case.verdict else None,
        causes=tuple(Cause(**cause) for cause in case.causes),
        notes=case.notes,
    )


def _counted(count: int, noun: str) -> str:
    """Returns a number with a noun, such as "2 pictures"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
