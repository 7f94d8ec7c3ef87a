"""The manifest: a whole line a picture, whatever happened before."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from glshade.batch.manifest import Manifest
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import GlshadeError

TASK = Task(0, "s.toml", "", (("materials.red.kd", "0.5"),), frame=0, camera="top")
DONE = Record(0, "", "done", "d", "s", 10, {"draw": 0.5}, driver="llvmpipe", attempts=2)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "manifest.jsonl"


def lines(path: Path) -> list[dict[str, Any]]:
    text = path.read_text()
    assert not text or text.endswith("\n")
    return [json.loads(line) for line in text.splitlines()]


def of(folder: Path, name: str, record: Record = DONE, **more: Any) -> Record:
    return replace(record, output=str(folder / name), **more)


def test_a_line_says_what_was_asked_and_what_came_of_it(path: Path, tmp_path: Path) -> None:
    with Manifest(path) as manifest:
        manifest.add(TASK, of(tmp_path, "out/a.png"))
    assert lines(path) == [
        {
            "output": "out/a.png",
            "state": "done",
            "scene": "s.toml",
            "frame": 0,
            "camera": "top",
            "overrides": {"materials.red.kd": "0.5"},
            "digest": "d",
            "sha256": "s",
            "size": 10,
            "seconds": {"draw": 0.5},
            "driver": "llvmpipe",
            "attempts": 2,
            "exit_code": 0,
        }
    ]


def test_what_is_skipped_has_one_line(path: Path, tmp_path: Path) -> None:
    for _ in range(2):
        with Manifest(path) as manifest:
            manifest.add(TASK, of(tmp_path, "known.png", state="done"))
            manifest.add(TASK, of(tmp_path, "known.png", state="skipped"))
            manifest.add(TASK, of(tmp_path, "lost.png", state="skipped"))
            # By its existence alone: nobody knows what it is.
            manifest.add(TASK, of(tmp_path, "there.png", state="skipped", digest="", sha256=""))
            manifest.add(TASK, of(tmp_path, "lost.png", state="skipped"))
        expected = [("known.png", "done"), ("lost.png", "done")]
        assert [(line["output"], line["state"]) for line in lines(path)] == expected
        path.unlink()


def test_a_picture_that_failed_since_is_not_known(path: Path, tmp_path: Path) -> None:
    for record in (of(tmp_path, "a.png"), of(tmp_path, "a.png", state="failed"), of(tmp_path, "a.png", state="skipped")):
        with Manifest(path) as manifest:
            manifest.add(TASK, record)
    assert [line["state"] for line in lines(path)] == ["done", "failed", "done"]


@pytest.mark.parametrize("torn", ['{"output": "b.png", "sta', "{", '{"output": "b.png", "state": "done"}'])
def test_a_torn_line_goes(torn: str, path: Path, tmp_path: Path) -> None:
    with Manifest(path) as manifest:
        manifest.add(TASK, of(tmp_path, "a.png"))
    with path.open("a") as file:
        file.write(torn)
    with Manifest(path) as manifest:
        manifest.add(TASK, of(tmp_path, "a.png", state="skipped"))
        manifest.add(TASK, of(tmp_path, "b.png", state="skipped"))
    assert [line["output"] for line in lines(path)] == ["a.png", "b.png"]


def test_what_is_no_manifest(tmp_path: Path) -> None:
    for path, fault in ((tmp_path, "Is a directory"), (tmp_path / "no" / "m.jsonl", "No such file")):
        with pytest.raises(GlshadeError, match=f"{path}: cannot be written: {fault}"):
            Manifest(path)
    full = Path("/dev/full")
    if full.exists():
        with Manifest(full) as manifest, pytest.raises(GlshadeError, match="/dev/full: cannot be written: No space left"):
            manifest.add(TASK, DONE)


def test_tasks_and_records_go_through_json(tmp_path: Path) -> None:
    task = replace(TASK, film={"size": [3, 2]}, settings=({"shading": "flat"},), resume=True, output="x.png")
    assert Task.from_dict(json.loads(json.dumps(task.as_dict()))) == task
    assert Task.from_dict(Task(0, "s", "o").as_dict()) == Task(0, "s", "o")
    record = replace(DONE, output="x.png", device=0, warnings=("a", "b"), stops=True)
    assert Record.from_dict(json.loads(json.dumps(record.as_dict()))) == record
