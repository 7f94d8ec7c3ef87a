"""docs/digits.md: its files, commands and Python run, it quotes what the command prints, and its pictures show the story."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.command import run_command
from support.folders import forget_models

from glshade.image.file import read

ROOT = Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "digits.md").read_text(encoding="utf-8")
IMAGES = ROOT / "docs" / "images"
FILES = dict(re.findall(r"`([\w./-]+)`:\n\n```\w+\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL))
COMMANDS = re.findall(r"^    glshade (.*)$", PAGE, flags=re.MULTILINE)


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Writes the files of the page, in whose folder a test runs."""
    forget_models(monkeypatch)
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


def test_the_page_has_its_files_and_commands() -> None:
    assert FILES.keys() == {"models/glossy.glsl", "mended/glossy.glsl", "ball.toml", "cosine.test.glsl"}
    assert {command.split()[0] for command in COMMANDS} == {"render", "digits", "test", "verify"}
    assert len(COMMANDS) == 10


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_runs(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    done = run_command(capsys, *command.split())
    assert (done.code, done.err) == (0, "")
    assert done.out


def test_the_mended_form_is_clean_where_the_first_one_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    limit = ("ball.toml", "--size", "32x24", "--limit", "1e-4", "--models")
    assert run_command(capsys, "digits", *limit, "mended").code == 0
    with pytest.MonkeyPatch.context() as patch:
        forget_models(patch)
        assert run_command(capsys, "digits", *limit, "models").code == 6


@pytest.mark.slow
def test_it_quotes_what_the_command_prints() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "script" / "digits_page.py", "--check"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_python_shows_an_exact_and_another_value(python: object) -> None:
    first, second, _ = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    exact, gpu = (np.fromstring(line.strip("[]"), sep=" ") for line in python(first).splitlines())  # type: ignore[operator]
    assert exact == pytest.approx([0.23996731, 0.24251379, 0.25015322])
    assert np.abs(gpu - exact).max() > 0.01
    rows = python(second).splitlines()  # type: ignore[operator]
    assert rows[0].split()[:4] == ["line", "variable", "float64", "float32"]
    assert any(row.startswith("glossy.glsl:16    t ") for row in rows)


def test_the_wrong_picture_is_rough_and_the_mended_one_smooth() -> None:
    wrong, right = (read(IMAGES / f"digits-{name}.png")[0][..., 0] for name in ("wrong", "right"))
    assert wrong.shape == right.shape == (192, 256)
    steps = [np.abs(np.diff(picture, axis=1)).max() for picture in (wrong, right)]
    assert steps[0] > 0.9
    assert steps[1] < 0.1


def test_the_map_is_pale_at_the_highlight_and_darker_outside() -> None:
    found = read(IMAGES / "digits-map.png")[0][..., :3].sum(axis=2)
    assert found[90:100, 120:130].mean() > found[:10, :10].mean() + 0.5


def test_the_pictures_are_small() -> None:
    sizes = [path.stat().st_size for path in IMAGES.glob("digits-*.png")]
    assert len(sizes) == 3
    assert max(sizes) <= 60_000
