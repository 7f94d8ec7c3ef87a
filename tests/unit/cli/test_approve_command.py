"""`glshade approve`: what it prints, its exit codes, and what it refuses."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import run_command
from support.compared import LLVMPIPE, SOFTPIPE, compare_all, write_picture

from glshade.golden.results import ResultsWriter, read
from glshade.golden.sidecar import Driver, Origin

GREY = np.full((20, 30, 3), 100, dtype=np.uint8)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function `run(*arguments)` that runs `glshade approve` in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return partial(run_command, capsys, "approve")


def compare(driver: Driver | None = None, **pictures: Any) -> None:
    """Compares pictures, by names without .png, with the folder `base`, and writes the results to the folder `out`."""
    named = {f"{name}.png": pixels for name, pixels in pictures.items()}
    compare_all(Path("base"), Path("out"), named, origin=Origin(driver=driver))


def test_the_pictures_of_a_run_become_baselines(run: Any) -> None:
    compare(ball=GREY, cube=GREY)
    assert run("out", "--dry-run") == (
        0,
        "new       ball.png\nnew       cube.png\n2 pictures would be approved; nothing was changed\n",
        "",
    )
    assert not Path("base").exists()
    assert run("out") == (0, "new       ball.png\nnew       cube.png\napproved 2 pictures\n", "")
    compare(ball=GREY + 51, cube=GREY + 1)
    assert run("out") == (0, "replaced  ball.png: distance 0.2\napproved 1 picture\n", "")
    compare(ball=GREY + 51, cube=GREY + 1)
    assert run("out") == (0, "nothing to approve: all 2 pictures passed\n", "")
    assert run("out", "--only", "b*") == (0, "same      ball.png\napproved 0 pictures\n", "")
    assert run("out", "--only", "cube.png", "--only", "b*") == (
        0,
        "same      ball.png\nreplaced  cube.png: distance 0.00392\napproved 1 picture\n",
        "",
    )


def test_a_variant(run: Any) -> None:
    compare(LLVMPIPE, ball=GREY)
    run("out")
    compare(SOFTPIPE, ball=GREY + 51)
    assert run("out", "--as-variant") == (0, "new       ball@softpipe.png\napproved 1 picture\n", "")
    compare(ball=GREY + 102)
    code, out, err = run("out", "--as-variant", "old")
    assert (code, err) == (0, "")
    assert out == "new       ball@old.png\napproved 1 picture\n"
    assert sorted(path.name for path in Path("base").glob("*.png")) == ["ball.png", "ball@old.png", "ball@softpipe.png"]


def test_a_variant_counts_in_the_next_comparison(run: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """Whether the main picture has a sidecar or not, and whether folders or files are compared."""
    write_picture(Path("base/ball.png"), GREY)
    write_picture(Path("new/ball.png"), GREY + 51)
    for paths, key in ((("base", "new"), "one"), (("base/ball.png", "new/ball.png"), "two")):
        assert run_command(capsys, "compare", *paths, "--report", "out").code == 2
        assert run("out", "--as-variant", key) == (0, f"new       ball@{key}.png\napproved 1 picture\n", "")
        assert run_command(capsys, "compare", "base/ball.png", "new/ball.png").code == 0
        assert run_command(capsys, "compare", "base", "new").code == 0
        write_picture(Path("new/ball.png"), GREY + 102)


def test_a_ramp_of_approvals(run: Any) -> None:
    """50 approvals of half a code each: every second column gets brighter, and in the next step the others do."""
    for step in range(50):
        pixels = GREY + np.uint8(step // 2)
        pixels[:, ::2] += np.uint8(step % 2)
        compare(ball=pixels)
        (case,) = read(Path("out"))
        assert case.passed or step == 0
        code, out, err = run("out", "--only", "ball.png")
        if code:
            break
        assert out.endswith("approved 1 picture\n")
    assert step == 3
    assert (code, out) == (1, "")
    assert err.count("\n") == 2
    assert err.startswith("glshade: ball.png: has crept away from the first approved picture, ")
    assert "--accept-drift\nglshade: nothing was approved; " in err
    assert run("out", "--only", "ball.png", "--accept-drift").code == 0


def test_nothing_is_approved_if_one_picture_is_refused(run: Any) -> None:
    compare(ball=GREY, cube=GREY)
    next(Path("out").rglob("ball-*/actual.png")).unlink()
    code, out, err = run("out")
    assert (code, out) == (1, "")
    assert err.startswith("glshade: out/cases/ball-")
    assert not Path("base").exists()
    assert run("out", "--only", "cube.png").code == 0


def test_a_run_that_was_killed_is_approved_as_far_as_it_came(run: Any) -> None:
    compare(ball=GREY)
    (case,) = read(Path("out"))
    writer = ResultsWriter(Path("more"), "run")
    writer.add(case, {"actual": Path("out", str(case.actual))})
    assert not Path("more/results.json").exists()
    assert run("more") == (0, "new       ball.png\napproved 1 picture\n", "")


def test_results_without_pictures(run: Any) -> None:
    compare()
    assert run("out") == (0, "nothing to approve: the run compared no pictures\n", "")


def test_the_folder_of_baselines(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compare(ball=GREY)
    (tmp_path / "project/base").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "project")
    code, out, err = run("../out")
    assert (code, out) == (2, "")
    assert f"the baselines of this run, {tmp_path}/base, are not in the current folder: give --baselines FOLDER" in err
    assert run("../out", "--baselines", "absent/base").code == 2
    assert run("../out", "--baselines", "new") == (0, "new       ball.png\napproved 1 picture\n", "")
    assert run("../out", "--baselines", "base") == (0, "new       ball.png\napproved 1 picture\n", "")
    assert Path("base/ball.png").exists()
    assert not (tmp_path / "base").exists()


def test_results_with_several_folders_of_baselines(run: Any) -> None:
    compare(ball=GREY, cube=GREY)
    text = json.loads(Path("out/results.json").read_text())
    text["cases"][0]["baseline_root"] += "2"
    Path("out/results.json").write_text(json.dumps(text))
    code, _, err = run("out")
    assert code == 2
    assert "the results name several folders of baselines" in err
    assert run("out", "--only", "cube.png").code == 0


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((), "Missing argument 'RESULTS'"),
        (("out", "--only", "bell.png"), "no picture of the run matches 'bell.png'; did you mean \"ball.png\"?"),
        (("out", "--from", "memory"), "'memory' is not 'reference'"),
        (("out", "--from", "reference", "--as-variant"), "leave out --as-variant"),
        (("out", "--sometimes"), "No such option"),
    ],
)
def test_wrong_usage(run: Any, arguments: tuple[str, ...], reason: str) -> None:
    compare(ball=GREY)
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert reason in err
    assert not Path("base").exists()


@pytest.mark.parametrize(
    ("folder", "reason"),
    [
        ("absent", "glshade: absent: holds no results (no results.json); give the folder that `glshade compare --report` or "),
        (".", "glshade: .: holds no results"),
        ("out/results.json", "glshade: out/results.json: holds no results, but is a file; give the folder in which it lies"),
        ("damaged", "glshade: damaged/results.json: is damaged: "),
        (
            "later",
            "glshade: later/results.json: was written by a later version of glshade (format 99, known: 1); update glshade",
        ),
    ],
)
def test_folders_that_are_no_results(run: Any, folder: str, reason: str) -> None:
    compare(ball=GREY)
    for name, text in (("damaged", "{"), ("later", '{"version": 99}')):
        Path(name).mkdir()
        Path(name, "results.json").write_text(text)
    code, out, err = run(folder)
    assert (code, out) == (1, "")
    assert err.startswith(reason)
    assert err.count("\n") == 1


def test_the_reference_approves_a_scene(run: Any) -> None:
    Path("ball.toml").write_text('objects = [{ shape = "sphere" }]\nfilm = { size = [16, 16], samples = 4 }\n')
    origin = Origin(made_by="driver", driver=LLVMPIPE, scene=str(Path("ball.toml").absolute()))
    compare_all(Path("base"), Path("out"), {"ball.png": GREY}, origin=origin)
    code, out, err = run("out", "--from", "reference")
    assert (code, err) == (0, "")
    assert out.startswith("new       ball.png\n")
    sidecar = json.loads(Path("base/ball.png.glshade.json").read_text())
    assert (sidecar["made_by"], sidecar["scene"]) == ("reference", "../ball.toml")


def test_approving_opens_no_context(python: Any, run: Any) -> None:
    compare(ball=GREY)
    code = "import sys; sys.argv = ['glshade', 'approve', 'out']; from glshade.cli import cli; cli.main(standalone_mode=False)"
    loaded = set(python(f"{code}; print(*sys.modules)").split())
    assert "glshade.golden.approval" in loaded
    assert not loaded & {"moderngl", "rich", "scipy", "jinja2", "glshade.gl.renderer", "glshade.reference.picture"}
