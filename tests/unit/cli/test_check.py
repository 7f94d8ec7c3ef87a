"""`glshade check`: every error of every program, once, in each of its forms."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from support.command import Result, run_command
from support.folders import forget_models, write

from glshade.glsl.shaders import SHIPPED

Run = Callable[..., Result]
SCENE = """
objects = [{ shape = "sphere", material = { brdf = "phong" } }]
lights = [{ type = "spot", position = [0, 0, 3], direction = [0, 0, -1] }]
"""
# Edits of three files, with the line and the column of each error.
FIVE = {
    "brdf/phong.glsl": (
        ("float NoV = dot(f.n, v);", "float NoV = dot(f.n, v)", (18, 5)),
        ("INV_PI : 0.0;", "INV_PIE : 0.0;", (19, 42)),
    ),
    "math/unit.glsl": (("return x *", "return y *", (6, 12)),),
    "light/spot.glsl": (
        ("vec3 q = l - light.axis;", "vec2 q = l - light.axis;", (17, 5)),
        ("return light.intensity", "return light.intensitty", (19, 12)),
    ),
}


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`run(*arguments)` as `glshade`, in a folder with s.toml, each time without model folders."""
    write(tmp_path, "s.toml", SCENE)
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Result:
        with pytest.MonkeyPatch.context() as patch:
            forget_models(patch)
            return run_command(capsys, *arguments)

    return run


def copied(name: str, *edits: tuple[str, str]) -> Path:
    """Returns a copy of a shipped file in the folder own/, with these replacements."""
    text = (SHIPPED / name).read_text()
    for old, new in edits:
        assert text.count(old) == 1, (name, old)
        text = text.replace(old, new)
    return write(Path("own").absolute(), name, text)


@pytest.fixture
def five(run: Run) -> dict[tuple[str, int, int], str]:
    """Writes the five errors. Returns (file, line, column) of each error -> the new text."""
    errors = {}
    for name, edits in FIVE.items():
        path = copied(name, *((old, new) for old, new, _ in edits))
        errors |= {(str(path), *place): new for _, new, place in edits}
    return errors


def test_five_errors_in_three_files(run: Run, five: dict[tuple[str, int, int], str]) -> None:
    done = run("check", "s.toml", "--shaders", "own", "--json")
    assert done.code == 4
    problems = json.loads(done.out)["problems"]
    assert {(problem["file"], problem["line"], problem["column"]) for problem in problems} == five.keys()
    assert len(problems) == 5
    for problem in problems:
        assert problem["excerpt"][problem["line"] - problem["first_line"]]
        assert problem["caret"] == problem["column"]


def test_a_mend_clears_them(run: Run, five: dict[tuple[str, int, int], str]) -> None:
    for name in FIVE:
        copied(name)
    done = run("check", "s.toml", "--shaders", "own")
    assert (done.code, done.err) == (0, "")
    assert done.out.endswith(" programs, no errors\n")


def test_text_has_an_excerpt_and_a_caret(run: Run) -> None:
    path = copied("math/unit.glsl", ("return x *", "return y *"))
    done = run("check", "s.toml", "--shaders", "own")
    assert done.code == 4
    lines = done.out.splitlines()
    assert lines[0].startswith(f"{path}:6:12: ")
    assert lines[3].startswith("     6 |     return y * ")
    assert lines[4] == "       |            ^"
    assert lines[-1].endswith(" programs, 1 error")


def test_annotations_of_a_workflow(run: Run) -> None:
    copied("math/unit.glsl", ("return x *", "return y *"))
    done = run("check", "s.toml", "--shaders", "own", "--github")
    assert done.out.splitlines()[0].startswith("::error file=own/math/unit.glsl,line=6,col=12::")


def test_generated_text_has_an_excerpt(run: Run) -> None:
    """The generated code sets the members of the struct; the programs differ in their lines, but the error is one."""
    copied("brdf/phong.glsl", ("    vec3 ka;\n", ""))
    done = run("check", "s.toml", "--shaders", "own", "--json")
    (generated,) = (problem for problem in json.loads(done.out)["problems"] if problem["file"] == "<surface>")
    assert "m.ka" in generated["excerpt"][generated["line"] - generated["first_line"]]


def test_every_include_that_is_missing(run: Run) -> None:
    text = (SHIPPED / "brdf/phong.glsl").read_text()
    path = write(Path("own").absolute(), "brdf/phong.glsl", f'#include "math/none.glsl"\n#include "math/nor.glsl"\n{text}')
    done = run("check", "s.toml", "--shaders", "own", "--json")
    assert done.code == 4
    problems = json.loads(done.out)["problems"]
    assert [(problem["file"], problem["line"]) for problem in problems] == [(str(path), 1), (str(path), 2)]


def test_a_shader_file_is_checked_in_all_programs(run: Run) -> None:
    """The ambient reflectance is in no program of the scene."""
    path = copied("brdf/phong.glsl", ("return m.ka;", "return m.kaa;"))
    assert run("check", "s.toml", "--shaders", "own").code == 0
    done = run("check", path, "--shaders", "own", "--json")
    assert done.code == 4
    assert [problem["line"] for problem in json.loads(done.out)["problems"]] == [24]


def test_faults_of_scenes(run: Run, tmp_path: Path) -> None:
    write(tmp_path, "wrong.toml", SCENE.replace("sphere", "spher"))
    done = run("check", "wrong.toml", "--json")
    assert done.code == 3
    (problem,) = json.loads(done.out)["problems"]
    assert (problem["line"], problem["stage"]) == (2, "scene")
    # A shader with errors decides the exit code.
    copied("math/unit.glsl", ("return x *", "return y *"))
    assert run("check", "wrong.toml", "s.toml", "--shaders", "own").code == 4


def test_faults_of_a_struct(run: Run, tmp_path: Path) -> None:
    glsl = "struct Mine {\n    int a;\n};\nvec3 brdf_cos(Mine m, Frame f, vec3 l, vec3 v) {\n    return vec3(0.0);\n}\n"
    for options in (("--shaders", "own", "own/brdf/mine.glsl"), ("--models", "models", "models/mine.glsl")):
        path = write(tmp_path, options[2], glsl)
        done = run("check", "s.toml", *options[:2], "--json")
        assert done.code == 4
        assert [(problem["file"], problem["line"]) for problem in json.loads(done.out)["problems"]] == [(str(path), 2)]
        path.unlink()
        write(tmp_path, "models/_.glsl", "")


def test_a_file_of_no_program(run: Run) -> None:
    path = write(Path("own").absolute(), "math/lonely.glsl", "float lonely() {\n    return 1.0;\n}\n")
    done = run("check", path, "--shaders", "own")
    assert done.code == 2
    assert "lonely.glsl is part of no program" in done.err


@pytest.mark.slow
def test_all_models_at_all_rates(run: Run) -> None:
    done = run("check")
    assert (done.code, done.err) == (0, "")
    copied("brdf/ward.glsl")
    write(Path("own").absolute(), "math/lonely.glsl", "")
    done = run("check", "--shaders", "own")
    assert done.code == 0
    assert "lonely.glsl is part of no program" in done.err


@pytest.mark.slow
def test_all_shipped_files_are_checked(run: Run) -> None:
    """Those that no scene asks for measure the driver or single models."""
    shipped = [path for path in SHIPPED.rglob("*") if path.is_file()]
    done = run("check", *shipped, "--json")
    unused = {Path(path).relative_to(SHIPPED).as_posix() for path in json.loads(done.out)["unused"]}
    others = {path for path in unused if not path.startswith(("driver/", "pass/cost.", "pass/evaluate."))}
    assert others <= {"output/power.glsl", "surface/placed_uv.glsl"}
