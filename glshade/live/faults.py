"""Faults: the problems of the user's files, as tables that travel over pipes and to pages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from glshade.errors import GlshadeError
from glshade.problem import Problem
from glshade.scene.problems import problems_of

Table = dict[str, Any]
# Errors that are not bugs of glshade. Deeply nested files make Python raise a RecursionError.
FAULTS = (GlshadeError, OSError, MemoryError, RecursionError)


def tables(error: BaseException) -> list[Table]:
    """Returns the problems of an error, one table each."""
    if isinstance(error, GlshadeError):
        return [problem.as_dict() for problem in problems_of(error)]
    if isinstance(error, RecursionError):
        return [Problem("", None, None, "files include or nest each other too deeply", "include").as_dict()]
    message = f"{getattr(error, 'filename', None) or ''}: {getattr(error, 'strerror', None) or error or type(error).__name__}"
    return [Problem("", None, None, message.removeprefix(": "), "driver").as_dict()]


def unique(problems: Iterable[Table]) -> list[Table]:
    """Returns tables in their order, each once."""
    found: list[Table] = []
    for problem in problems:
        if problem not in found:
            found.append(problem)
    return found
