"""docs/accuracy.md has a row for every model in each table. Its figures are those of the machine that made the page."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from glshade import BRDFS

ROOT = Path(__file__).resolve().parents[3]
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
