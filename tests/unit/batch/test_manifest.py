"""The manifest has one complete line for each picture, also after kills."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from glshade.batch.manifest import Manifest, NoManifest
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


def record(folder: Path, name: str, **changes: Any) -> Record:
    """Returns DONE for a file of the folder, with changed fields."""
    return replace(DONE, output=str(folder / name), **changes)


def test_a_line_holds_the_task_and_the_record(path: Path, tmp_path: Path) -> None:
    with Manifest(path) as manifest:
        manifest.add(TASK, record(tmp_path, "out/a.png"))
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


def test_a_skipped_picture_has_one_line(path: Path, tmp_path: Path) -> None:
    for _ in range(2):
        with Manifest(path) as manifest:
            manifest.add(TASK, record(tmp_path, "known.png", state="done"))
            manifest.add(TASK, record(tmp_path, "known.png", state="skipped"))
            manifest.add(TASK, record(tmp_path, "lost.png", state="skipped"))
            # --skip-existing does not read the file, so its digest is unknown.
            manifest.add(TASK, record(tmp_path, "there.png", state="skipped", digest="", sha256=""))
            manifest.add(TASK, record(tmp_path, "lost.png", state="skipped"))
        expected = [("known.png", "done"), ("lost.png", "done")]
        assert [(line["output"], line["state"]) for line in lines(path)] == expected
        path.unlink()


def test_a_picture_that_failed_later_gets_a_new_line(path: Path, tmp_path: Path) -> None:
    for state in ("done", "failed", "skipped"):
        with Manifest(path) as manifest:
            manifest.add(TASK, record(tmp_path, "a.png", state=state))
    assert [line["state"] for line in lines(path)] == ["done", "failed", "done"]


@pytest.mark.parametrize("torn", ['{"output": "b.png", "sta', "{", '{"output": "b.png", "state": "done"}'])
def test_an_incomplete_line_is_removed(torn: str, path: Path, tmp_path: Path) -> None:
    with Manifest(path) as manifest:
        manifest.add(TASK, record(tmp_path, "a.png"))
    with path.open("a") as file:
        file.write(torn)
    with Manifest(path) as manifest:
        manifest.add(TASK, record(tmp_path, "a.png", state="skipped"))
        manifest.add(TASK, record(tmp_path, "b.png", state="skipped"))
    assert [line["output"] for line in lines(path)] == ["a.png", "b.png"]


def test_files_that_cannot_be_a_manifest(tmp_path: Path) -> None:
    for path, fault in ((tmp_path, "Is a directory"), (tmp_path / "no" / "m.jsonl", "No such file")):
        with pytest.raises(GlshadeError, match=f"{path}: cannot be written: {fault}"):
            Manifest(path)
    full = Path("/dev/full")
    if full.exists():
        with Manifest(full) as manifest, pytest.raises(GlshadeError, match="/dev/full: cannot be written: No space left"):
            manifest.add(TASK, DONE)


@pytest.mark.parametrize("text", ["buy milk", "milk\nbread\n", '{"a": 1}\n', "[" * 200_000, "\n", '{"output" 1'])
def test_another_file_is_left_as_it_is(text: str, path: Path) -> None:
    path.write_text(text)
    with pytest.raises(NoManifest, match="is not a manifest") as caught:
        Manifest(path)
    assert caught.value.exit_code == 2
    assert path.read_text() == text


def test_the_command_leaves_another_file_as_it_is(tmp_path: Path, glshade: Any) -> None:
    (tmp_path / "s.toml").write_text('objects = [{ shape = "sphere" }]')
    (tmp_path / "notes.txt").write_text("buy milk")
    done = glshade("render", "s.toml", "-o", "x.png", "--manifest", "notes.txt", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "glshade: notes.txt: is not a manifest, and is left as it is: name another file\n"
    assert (tmp_path / "notes.txt").read_text() == "buy milk"
    assert not (tmp_path / "x.png").exists()


def test_a_line_that_no_parser_can_read_is_skipped(path: Path, tmp_path: Path) -> None:
    with Manifest(path) as manifest:
        manifest.add(TASK, record(tmp_path, "a.png"))
    with path.open("a") as file:
        file.write("[" * 200_000 + "\n")
    with Manifest(path) as manifest:
        assert manifest.known(str(tmp_path / "a.png")) == DONE.known == ("d", "s")


def test_tasks_and_records_go_through_json(tmp_path: Path) -> None:
    task = replace(TASK, film={"size": [3, 2]}, settings=({"shading": "flat"},), resume=True, known=("d", "s"), output="x.png")
    assert Task.from_dict(json.loads(json.dumps(task.as_dict()))) == task
    assert Task.from_dict(Task(0, "s", "o").as_dict()) == Task(0, "s", "o")
    result = replace(DONE, output="x.png", device=0, warnings=("a", "b"), stops=True)
    assert Record.from_dict(json.loads(json.dumps(result.as_dict()))) == result
