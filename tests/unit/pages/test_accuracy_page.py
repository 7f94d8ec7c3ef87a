"""docs/accuracy.md has a row for every model in each table. Its figures are those of the machine that made the page."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from glshade import BRDFS

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "script"))
accuracy = importlib.import_module("accuracy")
PAGE = (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8")


def test_every_model_has_its_row() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "script" / "accuracy.py", "--check"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr


def test_no_figure_is_above_its_bound_at_the_extremes() -> None:
    table = PAGE.split("\n## ")[1]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if line.startswith("| `")]
    assert len(rows) == len(BRDFS)
    for model, bound, vertex, fragment, *_ in rows:
        assert max(float(vertex), float(fragment)) <= float(bound), model


def test_it_says_what_was_measured() -> None:
    assert "Driver: " in PAGE
    assert "Made by script/make-accuracy" in PAGE


def test_a_quoted_line_that_changes_is_noticed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert accuracy.moved(PAGE) == []
    shutil.copytree(ROOT / "shaders", tmp_path / "shaders")
    monkeypatch.setattr(accuracy, "ROOT", tmp_path)
    assert accuracy.moved(PAGE) == []
    path = tmp_path / "shaders" / "math" / "cos_half.glsl"
    path.write_text(path.read_text().replace("0.25 * dot(q, q)", "dot(q, q) * 0.25"))
    assert set(accuracy.moved(PAGE)) == {"math/cos_half.glsl:6"}
    assert accuracy.moved(PAGE.split("## Line by line")[0]) == ["no line"]


@pytest.mark.slow
def test_every_line_that_is_to_blame_has_its_reason_and_its_row() -> None:
    lost = accuracy.lost()
    bad = {(accuracy.where(loss)[0], loss.text) for _, loss in lost if loss.to_blame}
    assert bad == accuracy.REASONS.keys()
    for model, loss in lost:
        if loss.to_blame:
            file, line = accuracy.where(loss)
            assert f"| `{model}` | {file}:{line} |" in PAGE
