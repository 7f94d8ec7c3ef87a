"""Fixtures of the tests of live pages."""

from __future__ import annotations

import pytest
from support.folders import forget_models


@pytest.fixture(autouse=True)
def nothing_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """The models that a test adds are forgotten afterwards: other tests in this process count all models."""
    forget_models(monkeypatch)
