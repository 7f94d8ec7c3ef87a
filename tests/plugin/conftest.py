"""Runs of pytest in the process of the tests, and the sample project, which is not collected."""

from __future__ import annotations

from typing import Any

import pytest
from _pytest import pytester

# The tests of the plugin copy this project, and run pytest in the copy.
collect_ignore = ["sample"]
_Snapshot = pytester.SysModulesSnapshot


@pytest.fixture(autouse=True)
def keep_modules(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets a run of pytest in this process keep what it imports, except its test files.

    pytester drops every module that such a run has imported first. NumPy cannot be imported a second time, and a model of
    glshade would become two classes.
    """

    def snapshot(preserve: Any = None) -> Any:
        return _Snapshot(preserve=lambda name: not name.startswith(("test_", "conftest")))

    monkeypatch.setattr(pytester, "SysModulesSnapshot", snapshot)
