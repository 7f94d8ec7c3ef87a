"""Messages: what a failed test says."""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from glshade.errors import printable
from glshade.golden import report
from glshade.golden.result import Result, SceneVerdict
from glshade.golden.results import Case, picture_path

if TYPE_CHECKING:
    from glshade.golden.pytest_plugin.settings import Settings
    from glshade.verification.laws import Finding, Law


def failure(settings: Settings, case: Case, result: Result) -> str:
    """Returns the verdict, the reason, the figures, the pictures, and the command that approves the test's picture."""
    lines = [f"no baseline: {printable(result.reason)}" if case.missing else _headline(result)]
    for kind in ("expected", "actual"):
        path = picture_path(settings.results, case, kind)
        if path is not None:
            lines.append(f"{kind}: {shortest(path, settings.start)}")
    lines.append(f"If the test's picture is right, run: {command(settings, case, result)}")
    return "\n".join(printable(text) for text in lines)


def _headline(result: Result) -> str:
    """Returns the verdict, the causes, the reason and the figures as one line."""
    return report.line(replace(result, name="")).partition(": ")[2]


def command(settings: Settings, case: Case, result: Result) -> str:
    """Returns the command that approves a case, to be run in the folder in which pytest was started."""
    from glshade.golden.approval import approve_command

    text = approve_command(Path(shortest(settings.results, settings.start)), [case.name])
    if not settings.baselines.is_relative_to(settings.start):
        # The command writes below the current folder alone, unless it is told where the baselines are.
        text += f" {shlex.join(['--baselines', str(settings.baselines)])}"
    if result.verdict is SceneVerdict.BOTH_RIGHT and case.driver is not None:
        text += f" --as-variant {case.driver.family}"
    return text


def not_same(result: Result, paths: Sequence[Path], start: Path) -> str:
    """Returns the reason why two pictures are not the same, the figures, and the files that hold them."""
    return "\n".join([_headline(result), *(f"{path.stem}: {shortest(path, start)}" for path in paths)])


def broken_law(finding: Finding, law: Law) -> str:
    """Returns the law, and by how much the scene breaks it."""
    drawn_by = "the GPU" if finding.drawn_by == "gpu" else "the float64 reference"
    return (
        f"the law {finding.law} is broken ({law.description}): drawn by {drawn_by}, {finding.broken} of {finding.pixels} "
        f"pixels are outside of their intervals; the largest deviation is {finding.deviation:.3g} [linear], and "
        f"{finding.allowance:.3g} is allowed"
    )


def keep(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Copies files into a folder, and returns the copies. Errors: OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    return [Path(shutil.copyfile(path, folder / path.name)) for path in paths]


def shortest(path: Path, start: Path) -> str:
    """Returns a path relative to a folder if it lies in it, and else the whole path."""
    return os.path.relpath(path, start) if path.is_relative_to(start) else str(path)
