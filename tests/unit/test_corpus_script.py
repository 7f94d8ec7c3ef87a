"""The script tests/corpus.py: its table, its limits and its cameras."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.child import Child

CORPUS = Path(__file__).parent.parent / "corpus.py"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
# A child that answers a question, hangs or dies, as the question asks.
ECHO = """
import os, time
from support.child import serve
def answer(question):
    if question == "hang":
        time.sleep(60)
    if question == "die":
        os._exit(3)
    if question == "memory":
        bytearray(1 << 40)
    return {"outcome": question}
serve(answer)
"""


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(CORPUS.parent), os.environ.get("PYTHONPATH", "")]))


@pytest.mark.usefixtures("environment")
def test_a_child_is_replaced_when_it_dies() -> None:
    child = Child([sys.executable, "-c", ECHO], 60.0, 1 << 30)
    try:
        outcomes = [child.ask(question)["outcome"] for question in ("a", "die", "b", "memory", "c")]
    finally:
        child.close()
    assert outcomes == ["a", "crash", "b", "crash", "c"]


@pytest.mark.slow
@pytest.mark.usefixtures("environment")
def test_a_child_is_replaced_when_it_hangs() -> None:
    child = Child([sys.executable, "-c", ECHO], 5.0, 1 << 30)
    try:
        start = time.monotonic()
        assert [child.ask(question)["outcome"] for question in ("hang", "d")] == ["hang", "d"]
        assert time.monotonic() - start < 30, "the child that hangs sleeps for a minute"
    finally:
        child.close()


@pytest.mark.slow
@pytest.mark.usefixtures("environment")
def test_every_outcome_is_told(tmp_path: Path) -> None:
    folder = tmp_path / "meshes"
    (folder / "far").mkdir(parents=True)
    (folder / "good.obj").write_text(TRIANGLE)
    (folder / "warned.obj").write_text("mtllib gone.mtl\n" + TRIANGLE)
    (folder / "refused.ply").write_text("ply\n")
    # The camera of this manifest is so far away that the picture is empty.
    (folder / "far" / "away.obj").write_text(TRIANGLE)
    models = [{"fileName": "away.obj", "camera": {"translation": [0, 0, 1e6]}}]
    (folder / "far" / "Manifest.json").write_text(json.dumps({"models": models}))
    report, sheet = tmp_path / "report.json", tmp_path / "sheet.png"
    command = [sys.executable, str(CORPUS), str(folder), "--sheet", str(sheet), "--report", str(report)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    outcomes = {row["file"]: row["outcome"] for row in json.loads(report.read_text())}
    assert outcomes == {"good.obj": "drawn", "warned.obj": "warned", "refused.ply": "refused", "far/away.obj": "wrong"}
    assert "1 drawn, 1 warned, 1 refused, 1 wrong" in done.stdout
    assert sheet.is_file()
