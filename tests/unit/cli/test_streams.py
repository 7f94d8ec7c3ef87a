"""Standard streams that the caller has closed: the work is done, and the exit code is the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCENE = 'objects = [{ shape = "sphere" }]\nfilm = { size = [24, 16] }\n'

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell")


def run(folder: Path, closed: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs `glshade` from a shell. closed: the shell's words that close streams, such as `2>&-`."""
    return subprocess.run(
        ["sh", "-c", f'exec "$@" {closed}', "sh", sys.executable, "-m", "glshade", *arguments],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_batch_with_closed_streams(closed: str, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(SCENE)
    done = run(tmp_path, closed, "render", "s.toml", "-f", "1-2", "-o", "f.#.png", "--jobs", "1")
    assert done.returncode == 0
    assert done.stderr == ""
    names = ["f.1.png", "f.2.png"]
    assert sorted(done.stdout.split()) == ([] if closed != "2>&-" else names)
    assert sorted(path.name for path in tmp_path.glob("f.*")) == names


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_an_error_with_closed_streams(closed: str, tmp_path: Path) -> None:
    done = run(tmp_path, closed, "render", "missing.toml", "-o", "x.png")
    assert done.returncode == 3
    assert ("missing.toml" in done.stderr) == (closed == ">&-")
