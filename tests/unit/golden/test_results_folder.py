"""Folders of results: written by several processes, cut short, damaged, and from strangers."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.compared import compare_all, write_picture

from glshade.errors import GlshadeError
from glshade.golden.result import Cause, Finding, LayerResult, Metrics, Outcome, Result, SceneVerdict
from glshade.golden.results import Case, ResultsWriter, case_of, picture_path, read
from glshade.golden.rules import RULES

GREY = np.full((4, 6, 3), 100, dtype=np.uint8)


def case(name: str = "ball.png", id: str = "", **values: Any) -> Case:
    return Case.model_validate({"id": id or name, "name": name, "baseline_root": "/root", "outcome": "same", **values})


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    return write_picture(tmp_path / "ball.png", GREY)


@settings(max_examples=10)  # Each waits until the file is on the disk.
@given(st.lists(st.tuples(st.sampled_from("abcdefgh"), st.integers(0, 2)), max_size=8, unique=True), st.data())
def test_any_number_of_processes_write_the_same_results(
    tmp_path_factory: pytest.TempPathFactory, tests: list[tuple[str, int]], data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("results")
    cases = [case(f"{number}.png", f"test::{name}") for name, number in tests]
    picture = write_picture(folder / "ball.png", GREY)
    alone, several = folder / "alone", folder / "several"
    writer = ResultsWriter(alone, "first")
    for one in cases:
        writer.add(one, {"actual": picture})
    writer.finish()
    workers = [ResultsWriter(several, "second", f"gw{number}") for number in range(3)]
    for one in data.draw(st.permutations(cases)):
        data.draw(st.sampled_from(workers)).add(one, {"actual": picture})
    controller = ResultsWriter(several, "second")
    found = controller.finish()
    assert files(alone) == files(several)
    assert read(several) == found
    assert [(one.id, one.name) for one in found] == sorted((one.id, one.name) for one in cases)
    for one in found:
        path = picture_path(several, one)
        assert path is not None
        assert path.read_bytes() == picture.read_bytes()


def files(folder: Path) -> dict[str, bytes]:
    """Returns the contents of all files in a folder, by their paths in it."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_folder_holds_what_was_compared(tmp_path: Path) -> None:
    write_picture(tmp_path / "base/cars/red one.png", GREY)
    compare_all(tmp_path / "base", tmp_path / "out", {"cars/red one.png": GREY + 9})
    text = json.loads((tmp_path / "out/results.json").read_text())
    assert text["version"] == 1
    (found,) = text["cases"]
    assert (found["id"], found["outcome"], found["missing"]) == ("cars/red one.png", "fail", False)
    assert found["baseline"] == "cars/red one.png"
    assert found["actual"].startswith("cases/cars-red-one-")
    assert found["files"].keys() == {"expected"}
    assert found["layers"][0]["metrics"]["worst"] == pytest.approx(9 / 255)
    assert sorted(files(tmp_path / "out")) == sorted(["results.json", found["actual"], found["files"]["expected"]])


def test_a_result_becomes_a_case(tmp_path: Path) -> None:
    layers = (LayerResult("", Finding(Outcome.FAIL, "far"), Metrics(0.5)), LayerResult("n", Finding(Outcome.SAME), None))
    cause = Cause("light", "light fill x 0.00", "ball", 3, "shading", 0.98, 200)
    result = Result(
        *("a\x1b.png", "out/a.png", Outcome.FAIL, "so\nwhat", layers, SceneVerdict.REGRESSION, (cause,)),
        baseline=str(tmp_path / "base/a@b.png"),
        distances={"a@b.png": 0.25},
        notes=("one",),
    )
    rule = RULES["idiff"](hardfail=0.5, warn=math.inf)  # type: ignore[call-arg]
    made = case_of(result, id="a\x1b.png", name="a.png", root=tmp_path / "base", rule=rule)
    assert (made.id, made.reason, made.verdict) == ("a\\u001b.png", "so\\u000awhat", "regression")
    assert (made.baseline, made.distances, made.notes) == ("a@b.png", {"a@b.png": 0.25}, ("one",))
    assert made.rule.rule() == rule
    assert made.causes[0]["text"] == "light fill x 0.00"
    assert [layer["name"] for layer in made.layers] == ["", "n"]
    assert Case.model_validate(json.loads(json.dumps(made.model_dump(mode="json"), allow_nan=False))) == made


def test_a_run_that_is_killed_keeps_its_cases(tmp_path: Path, picture: Path) -> None:
    old = ResultsWriter(tmp_path / "out", "old")
    old.add(case("old.png"), {"actual": picture})
    old.finish()
    writer = ResultsWriter(tmp_path / "out", "new", "gw1")
    kept = [writer.add(case(name), {"actual": picture}) for name in ("a.png", "b.png")]
    assert read(tmp_path / "out") == kept
    with open(tmp_path / "out/lines/new.gw1.jsonl", "ab") as file:
        file.write(b'{"id": "c.png", "na')
    assert read(tmp_path / "out") == kept
    # The next run begins anew.
    ResultsWriter(tmp_path / "out", "third").finish()
    assert read(tmp_path / "out") == []
    assert sorted(files(tmp_path / "out")) == ["results.json"]


def test_a_case_that_is_run_again_counts_once(tmp_path: Path, picture: Path) -> None:
    writer = ResultsWriter(tmp_path / "out", "run")
    writer.add(case(outcome="fail"), {"actual": picture, "difference": picture})
    last = writer.add(case(), {"actual": picture})
    assert writer.finish() == [last]
    assert sorted(files(tmp_path / "out")) == [last.actual, "results.json"]


def test_files_of_others_stay(tmp_path: Path, picture: Path) -> None:
    out = tmp_path / "out"
    (out / "cases/mine").mkdir(parents=True)
    (out / "cases/mine/notes.txt").write_text("mine")
    (out / "render.log").write_text("mine")
    for number in range(2):
        writer = ResultsWriter(out, f"run{number}")
        writer.add(case(f"{number}.png"), {"actual": picture})
        writer.finish()
    assert {name for name, data in files(out).items() if data == b"mine"} == {"cases/mine/notes.txt", "render.log"}
    assert len(list((out / "cases").iterdir())) == 2


def test_every_case_has_a_folder_of_its_own(tmp_path: Path, picture: Path) -> None:
    writer = ResultsWriter(tmp_path / "out", "run")
    names = ["a/b.png", "a-b.png", "a b.png", "A-b.png", "../../b.png", "x" * 250 + ".png", "ä.png", ".png"]
    made = [writer.add(case(name), {"actual": picture}) for name in names]
    made += [writer.add(case("a-b.png", f"test::{x}"), {"actual": picture}) for x in "12"]
    paths = {str(one.actual).casefold() for one in made}
    assert len(paths) == len(made)
    assert len(writer.finish()) == len(made)
    assert {path.parent.parent for path in (tmp_path / "out").rglob("actual.png")} == {tmp_path / "out/cases"}


def test_what_cannot_be_written_or_copied_is_named(tmp_path: Path, picture: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(GlshadeError, match="file/lines: the results cannot be written: Not a directory"):
        ResultsWriter(tmp_path / "file", "run").add(case(), {"actual": picture})
    os.mkfifo(tmp_path / "fifo.png")
    writer = ResultsWriter(tmp_path / "out", "run")
    made = writer.add(case(), {"actual": tmp_path / "absent.png", "expected": tmp_path / "fifo.png", "difference": picture})
    assert writer.finish() == [made]
    assert (made.actual, list(made.files)) == (None, ["difference"])
    assert made.notes == (
        f"{tmp_path}/absent.png: cannot be read: No such file or directory",
        f"{tmp_path}/fifo.png: cannot be read: is not a regular file",
    )


def test_names_that_are_not_utf_8(tmp_path: Path, picture: Path) -> None:
    name = os.fsdecode(b"caf\xe9.p\xffng")
    source = tmp_path / name
    picture.rename(source)
    result = Result(name, str(source), Outcome.FILE, name, baseline=str(source), distances={name: 1.0}, notes=(name,))
    made = case_of(result, id=name, name=name, root=tmp_path, rule=RULES["codes"]())
    writer = ResultsWriter(tmp_path / "out", "run")
    writer.add(made, {"actual": source})
    (found,) = writer.finish()
    assert read(tmp_path / "out") == [found]
    assert found.name == found.reason == "caf\\udce9.p\\udcffng"
    path = picture_path(tmp_path / "out", found)
    assert path is not None
    assert path.read_bytes() == source.read_bytes()


def test_a_folder_without_results_is_named(tmp_path: Path) -> None:
    with pytest.raises(GlshadeError, match=r"holds no results \(no results.json\); give the folder that"):
        read(tmp_path)
    with pytest.raises(GlshadeError, match="holds no results"):
        read(tmp_path / "absent")
    (tmp_path / "results.json").write_text("")
    with pytest.raises(GlshadeError, match="is a file; give the folder in which it lies"):
        read(tmp_path / "results.json")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda text: text[:-9], "is damaged"),
        (lambda text: "[]", "is damaged: must be a table"),
        (lambda text: text.replace('"version": 1', '"version": 7'), r"was written by a later version of glshade \(format 7"),
        (lambda text: text.replace('"same"', '"splendid"'), "is damaged: cases.0.outcome: 'splendid' is not one of"),
        (lambda text: text.replace("ball.png", "ba\\u001bll.png"), "is damaged: cases.0.*has control characters"),
        (lambda text: text.replace("/root", "/ro\\u0000ot"), "is damaged: cases.0.baseline_root: has control characters"),
        (lambda text: text.replace('"distances": {}', '"distances": {"a": NaN}'), "is damaged: NaN is not a number of JSON"),
    ],
)
def test_damaged_results_are_one_line(tmp_path: Path, change: Any, reason: str) -> None:
    ResultsWriter(tmp_path, "run").finish()
    whole = json.loads((tmp_path / "results.json").read_text())
    whole["cases"] = [case().model_dump(mode="json")]
    text = json.dumps(whole)
    assert change(text) != text
    (tmp_path / "results.json").write_text(change(text))
    with pytest.raises(GlshadeError, match=f"^{tmp_path}/results.json: {reason}") as error:
        read(tmp_path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("path", ["../secret.png", "/etc/passwd", "cases/../../secret.png", "link.png", "loop.png"])
def test_pictures_lie_in_the_folder(tmp_path: Path, path: str) -> None:
    out = tmp_path / "out"
    out.mkdir()
    write_picture(tmp_path / "secret.png", GREY)
    (out / "link.png").symlink_to(tmp_path / "secret.png")
    (out / "loop.png").symlink_to("loop.png")
    hostile = case(actual=path, files={"expected": path})
    for kind in ("actual", "expected"):
        with pytest.raises(GlshadeError, match="lies outside the folder of the results"):
            picture_path(out, hostile, kind)
    assert picture_path(out, hostile, "difference") is None
    assert picture_path(out, case()) is None
