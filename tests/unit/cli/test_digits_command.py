"""`glshade digits`: its subjects, its forms of output, its exit codes, and its errors of one line."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.command import Result, run_command
from support.folders import forget_models, write

from glshade.image.file import read
from glshade.image.image import Image
from glshade.spirv import compiler

SUPPORT = Path(__file__).resolve().parents[2] / "support"
UNSTABLE, STABLE = (SUPPORT / folder / "spherical_gaussian.glsl" for folder in ("unstable", "stable"))
# Few inputs suffice for formulas that fail at most of them.
FEW = ("--count", 64)
SCENE = """
film = { size = [16, 12] }
objects = [{ shape = "sphere", material = "bad" }]
lights = [{ type = "directional", direction = [0, 0, -1] }]

[materials]
bad = { brdf = "spherical_gaussian", sharpness = 200 }
good = { brdf = "lambert", kd = 0.5 }
painted = { brdf = "lambert", kd = { texture = "paint.png" } }
"""
Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`run(*arguments)` as `glshade digits` in an empty folder, each time without model folders."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Result:
        with pytest.MonkeyPatch.context() as patch:
            forget_models(patch)
            return run_command(capsys, "digits", *arguments)

    return run


def test_a_file_is_shown_with_its_lines_and_the_worst_inputs(run: Run) -> None:
    done = run(UNSTABLE, *FEW)
    assert (done.code, done.err) == (0, "")
    head, *rows = done.out.split("\n\n")[0].splitlines()
    assert head.split() == ["line", "loses", "digits", "rounded", "inputs", "text"]
    assert {row.split()[0] for row in rows} >= {f"{UNSTABLE}:{line}" for line in (9, 10)}
    assert "is worst at l (" in done.out
    assert f"{UNSTABLE}: 2 lines are to blame" in done.out


@pytest.mark.parametrize("subject", ["lambert", "gold", "burley:roughness=0.3"])
def test_models_presets_and_changed_materials_are_clean(run: Run, subject: str) -> None:
    done = run(subject, *FEW)
    assert done.code == 0
    assert f"{subject}: no line is to blame" in done.out


def test_the_limit_counts_only_lines_that_are_to_blame(run: Run) -> None:
    assert run(UNSTABLE, *FEW, "--limit", "1e-4").code == 6
    assert run(UNSTABLE, *FEW, "--limit", "1").code == 0
    ill_posed = run(STABLE, *FEW, "--limit", "1e-6")
    assert "ill-posed" in ill_posed.out
    assert ill_posed.code == 0


def test_json(run: Run) -> None:
    found = json.loads(run(UNSTABLE, *FEW, "--json").out)
    assert found["subject"] == str(UNSTABLE)
    bad = [line for line in found["lines"] if line["to_blame"]]
    assert {line["place"] for line in bad} == {f"{UNSTABLE}:9", f"{UNSTABLE}:10"}
    assert found["error"] >= max(line["loss"] for line in bad) / 10
    assert bad[0]["at"].keys() == {"l", "v", "sharpness"}
    assert len(bad[0]["value"]) == 3
    assert not bad[0]["ill_posed"]
    assert not bad[0]["built_in"]


def test_annotations_for_github(run: Run) -> None:
    lines = run(UNSTABLE, *FEW, "--github").out.splitlines()
    assert len(lines) == 2
    assert {line.split("::")[1] for line in lines} == {f"warning file={UNSTABLE},line={number}" for number in (9, 10)}
    assert run(STABLE, *FEW, "--github").out == ""


class TestScene:
    """A scene is run at its pixels."""

    @pytest.fixture(autouse=True)
    def scene(self, run: Run, tmp_path: Path) -> None:
        write(tmp_path, "s.toml", SCENE.replace('painted = { brdf = "lambert", kd = { texture = "paint.png" } }', ""))
        write(tmp_path / "models", "spherical_gaussian.glsl", UNSTABLE.read_text())

    def test_lines_and_map(self, run: Run) -> None:
        done = run("s.toml", "--models", "models", "--map", "map.png", "--limit", "1e-6")
        assert done.code == 6
        assert "models/spherical_gaussian.glsl:10" in done.out
        colours = read(Path("map.png"))[0][..., :3]
        assert colours.shape == (12, 16, 3)
        # The corners show the background, which loses nothing; the highlight loses most.
        assert (colours[[0, 0, -1, -1], [0, -1, 0, -1]] == colours[0, 0]).all()
        assert colours.sum(axis=2).max() > colours[0, 0].sum() + 0.3

    def test_a_map_of_floats_has_the_errors(self, run: Run) -> None:
        run("s.toml", "--models", "models", "--map", "map.exr", "--size", "8x8")
        errors = read(Path("map.exr"))[0]
        assert errors.shape[:2] == (8, 8)
        assert errors[0, 0, 0] == 0
        assert 1e-6 < errors.max() <= 1

    def test_its_materials(self, run: Run) -> None:
        assert "2 lines are to blame" in run("s.toml:bad", "--models", "models", *FEW).out
        assert "no line is to blame" in run("s.toml:good", "--models", "models", *FEW).out

    def test_set_changes_a_value(self, run: Run) -> None:
        done = run("s.toml", "--models", "models", "--set", 'objects.0.material="good"', "--limit", "1e-6")
        assert done.code == 0


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["none.glsl"], 2, "none.glsl does not exist"),
        (["none.toml"], 3, "none.toml"),
        (["nothing"], 2, "no model or preset is named 'nothing'"),
        (["empty.glsl"], 2, "defines no model"),
        (["s.toml:painted"], 2, "kd is a texture"),
        (["lambert", "--map", "map.png"], 2, "need a scene"),
        (["lambert", "--size", "8x8"], 2, "need a scene"),
        (["lambert", "--count", "1"], 2, "16<=x"),
    ],
)
def test_errors_are_one_line(run: Run, tmp_path: Path, arguments: list[str], code: int, message: str) -> None:
    write(tmp_path, "empty.glsl", "float nothing() { return 0.0; }\n")
    shutil.copy(UNSTABLE, tmp_path)
    Image(np.zeros((2, 2, 3), np.uint8), "srgb").save(tmp_path / "paint.png")
    write(tmp_path, "s.toml", SCENE)
    done = run(*arguments, *(("--models", ".") if arguments[0].startswith("s.toml") else ()))
    assert done.code == code
    assert done.out == ""
    assert message in done.err.splitlines()[-1]


def test_without_the_compiler(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    compiler._binary.cache_clear()
    monkeypatch.setenv("PATH", "")
    done = run("lambert")
    assert done.code == 2
    assert done.err == "glshade: glslangValidator is not installed: apt install glslang-tools\n"
