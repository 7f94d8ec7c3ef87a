"""GLSL tests: collects the unit tests of files *.test.glsl (docs/digits.md), and runs them on the CPU and on the GPU."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from glshade.debug.shader_test import Outcome, ShaderTest, find_tests, run_test
from glshade.errors import ContextError, GlshadeError
from glshade.gl.context import Context, open_context
from glshade.glsl.shaders import current

# The context of this process, made for the first test; None in place of one that cannot be opened.
_CONTEXT: pytest.StashKey[Context | None] = pytest.StashKey()


class ShaderTestFile(pytest.File):
    """A file of unit tests in GLSL."""

    def collect(self) -> Iterator[ShaderTestItem]:
        """Yields the tests of the file. Errors: pytest's own for a file that cannot be read."""
        try:
            tests = find_tests(self.path)
        except GlshadeError as error:
            raise self.CollectError(str(error)) from None
        for test in tests:
            yield ShaderTestItem.from_parent(self, name=test.name, test=test)


class ShaderTestItem(pytest.Item):
    """One test."""

    def __init__(self, *, test: ShaderTest, **options: Any) -> None:
        super().__init__(**options)
        self._test = test

    def runtest(self) -> None:
        """Runs the test. Errors: ShaderTestFailed, GlshadeError."""
        folders = self.config.getoption("glshade_shaders") or self.config.getini("glshade_shaders") or ""
        shaders = current([Path(folder) for folder in folders.split(",") if folder])
        outcome = run_test(self._test, shaders, _context(self.config))
        if not outcome.passed:
            raise ShaderTestFailed(outcome)

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """Returns the values of the test's variables, or the message of an error on purpose."""
        if isinstance(excinfo.value, ShaderTestFailed):
            outcome = excinfo.value.outcome
            return "\n".join([outcome.error] if outcome.error else outcome.report())
        return str(excinfo.value) if isinstance(excinfo.value, GlshadeError) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Returns the test's file, its line counted from 0, and its name."""
        return self.path, self._test.line - 1, self.name


class ShaderTestFailed(Exception):
    """A test that does not hold.

    outcome: where it failed.
    """

    def __init__(self, outcome: Outcome) -> None:
        super().__init__(outcome.test.name)
        self.outcome = outcome


def _context(config: pytest.Config) -> Context | None:
    """Returns the context of this process, opened at the first call; None where none can be opened: the CPU is enough."""
    if _CONTEXT not in config.stash:
        try:
            config.stash[_CONTEXT] = open_context()
        except ContextError:
            config.stash[_CONTEXT] = None
    return config.stash[_CONTEXT]


def close(config: pytest.Config) -> None:
    """Closes the context, if one is open."""
    context = config.stash.get(_CONTEXT, None)
    if context is not None:
        context.release()
        config.stash[_CONTEXT] = None
