"""`glshade compare --scene`: the verdicts, their exit codes, and the reports of them."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from support import faulty
from support.command import run_command

from glshade.golden.result import Outcome, SceneVerdict


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function `run(*arguments)` that runs `glshade compare` in a folder with a scene and pictures of it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    Path("scene.json").write_text(json.dumps(faulty.SCENE))
    for folder in ("ref", "test"):
        Path(folder).mkdir()
    true = faulty.codes(faulty.drawn(faulty.scene()))
    dark = faulty.codes(faulty.drawn(faulty.scene(lambda d: d["lights"][1].update(intensity=0))))
    for name, reference, test in (("same", true, true), ("wrong", true, dark), ("stale", dark, true)):
        faulty.save(Path(f"ref/{name}.png"), reference)
        faulty.save(Path(f"test/{name}.png"), test)
    return partial(run_command, capsys, "compare")


WRONG = "regression: light fill x 0.00; "


def test_two_files(run: Any) -> None:
    code, out, err = run("ref/wrong.png", "test/wrong.png", "--scene", "scene.json")
    assert (code, err) == (2, "")
    assert out.startswith(f"fail   test/wrong.png: {WRONG}")
    assert "pixels are not what the scene allows; max 0." in out
    code, out, err = run("ref/stale.png", "test/stale.png", "--scene", "scene.json")
    assert (code, err) == (1, "")
    assert out.startswith("warn   test/stale.png: stale baseline; only the new picture is what the scene allows; approve it")
    assert run("ref/same.png", "test/same.png", "--scene", "scene.json") == (0, "same   test/same.png\n", "")
    assert run("ref/stale.png", "test/stale.png").code == 2, "without the scene, the rule judges"


def test_a_folder(run: Any) -> None:
    code, out, err = run("ref", "test", "--scene", "scene.json", "--json", "--junit", "junit.xml")
    assert (code, err) == (2, "")
    pairs = {pair["name"]: pair for pair in json.loads(out)["pairs"]}
    assert {name: pair["verdict"] for name, pair in pairs.items()} == {
        "same.png": None,
        "stale.png": "stale baseline",
        "wrong.png": "regression",
    }
    wrong = pairs["wrong.png"]
    assert wrong["scene"] == "scene.json"
    assert [cause["text"] for cause in wrong["causes"]] == ["light fill x 0.00"]
    assert wrong["causes"][0]["stage"] == "shading"
    assert wrong["drivers"] == {"reference": None, "test": None}
    failure = ElementTree.parse("junit.xml").getroot().find(".//failure")
    assert failure is not None
    assert failure.attrib["message"].startswith(WRONG)
    code, out, _ = run("ref", "test", "--scene", "scene.json", "--github")
    assert f"title=glshade compare%3A fail::fail   wrong.png: {WRONG}" in out


def test_the_report(run: Any) -> None:
    assert run("ref", "test", "--scene", "scene.json", "--report", "report").code == 2
    cases = {case["name"]: case for case in json.loads(Path("report/results.json").read_text())["cases"]}
    assert cases.keys() == {"same.png", "stale.png", "wrong.png"}
    wrong = cases["wrong.png"]
    assert (wrong["outcome"], wrong["verdict"]) == ("fail", "regression")
    assert wrong["scene"] == str(Path("scene.json").absolute())
    for name in (wrong["actual"], wrong["files"]["expected"], wrong["files"]["classes"]):
        assert Path("report", name).is_file()
    page = Path("report/index.html").read_text(encoding="utf-8")
    assert "light fill x 0.00" in page


def test_the_scene_can_be_changed(run: Any) -> None:
    scene = ("--scene", "scene.json", "--set", "lights.fill.intensity=0")
    assert run("ref/wrong.png", "test/wrong.png", *scene).code == 1
    assert run("ref/stale.png", "test/stale.png", *scene).code == 2
    assert run("ref/wrong.png", "test/wrong.png", "--set", "lights.fill.intensity=0").code == 64


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("absent.json", "absent.json: there is no such file"),
        ("broken.json", "broken.json: "),
        ("folder", "folder"),
        ("small.json", "its picture has 10x10 pixels, and the compared ones have 96x72"),
    ],
)
def test_a_scene_that_cannot_be_used_is_a_file(scene: str, words: str, run: Any) -> None:
    Path("broken.json").write_text('{"objects": 3}')
    Path("small.json").write_text(json.dumps({**faulty.SCENE, "film": {"size": [10, 10]}}))
    Path("folder").mkdir()
    code, out, err = run("ref", "test", "--scene", scene)
    assert (code, err) == (4, "")
    assert words in out
    assert out.splitlines()[-1].endswith("3 pairs: 1 same, 2 file"), "equal pictures need no scene"


def test_verdicts_have_outcomes() -> None:
    assert {verdict: verdict.outcome for verdict in SceneVerdict} == {
        SceneVerdict.SAME: Outcome.SAME,
        SceneVerdict.FREEDOM: Outcome.SAME,
        SceneVerdict.BOTH_RIGHT: Outcome.WARN,
        SceneVerdict.STALE: Outcome.WARN,
        SceneVerdict.REGRESSION: Outcome.FAIL,
    }


def test_layers_of_a_file_are_judged_by_the_rule(run: Any) -> None:
    from glshade.image import file as picture_file
    from glshade.image.contents import PictureContents

    true = faulty.drawn(faulty.scene())
    depth = np.ones((*true.shape[:2], 1), dtype=np.float32)
    for name, layer in (("a", depth), ("b", depth * 2)):
        pixels = np.concatenate([true, layer], axis=2)
        contents = PictureContents(pixels, "linear", premultiplied=True, channels=("R", "G", "B", "depth.Z"))
        picture_file.write(Path(f"{name}.exr"), contents)
    code, out, _ = run("a.exr", "b.exr", "--scene", "scene.json")
    assert code == 2
    assert "layer depth: " in out
