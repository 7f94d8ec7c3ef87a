"""`glshade laws`: its table, its JSON and its exit codes."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import run_command

from glshade.scene.object import Transform
from glshade.verification.laws import LAWS

SCENE = """
film = { size = [24, 16] }
objects = [{ shape = "cube", transform = { rotate = [10, 20, 30] } }]
"""


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function `run(*arguments)` that runs `glshade` in a folder that holds s.toml."""
    (tmp_path / "s.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    return partial(run_command, capsys)


def test_all_laws_that_apply_hold(run: Any) -> None:
    result = run("laws", "s.toml")
    assert result.code == 0, result.out
    lines = result.out.splitlines()
    assert lines[0].split() == ["law", "drawn", "by", "pixels", "deviation", "allowance", "used", "outcome"]
    assert [line for line in lines if line.startswith("turned ") and line.endswith("holds")] != []
    assert "parents-flattened does not apply: no object has a parent" in lines
    assert all(any(line.startswith(name) for line in lines) for name in LAWS)


def test_findings_as_json(run: Any) -> None:
    result = run("laws", "s.toml", "--only", "rotations", "--only", "objects-reordered", "--json", "--size", "16x12")
    findings = json.loads(result.out)
    assert [(finding["law"], finding["drawn_by"]) for finding in findings] == [
        (law, drawn_by) for law in ("rotations", "objects-reordered") for drawn_by in ("reference", "gpu")
    ]
    assert findings[0]["outcome"] == "holds"
    assert 100 < findings[0]["pixels"] <= 16 * 12
    assert findings[2]["outcome"] == "does not apply"
    assert findings[2]["reason"] == "there is only one object"


def test_a_broken_law_is_exit_code_6(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    array = Transform.array
    monkeypatch.setattr(Transform, "array", lambda self: array(self) if self.matrix else array(self) @ np.diag([1.1, 1, 1, 1]))
    result = run("laws", "s.toml", "--only", "rotations")
    assert result.code == 6
    assert "broken at" in result.out


def test_an_unknown_law_is_wrong_usage(run: Any) -> None:
    result = run("laws", "s.toml", "--only", "rotatons")
    assert result.code == 2
    assert "no law is named 'rotatons'; did you mean \"rotations\"?" in result.err
