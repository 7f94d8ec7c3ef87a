"""What the pytest plugin accepts and refuses. The messages are read from pytest's own output."""

from __future__ import annotations

import shutil
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

from glshade.errors import ContextError
from glshade.golden.baselines import Baselines
from glshade.golden.pytest_plugin import checking
from glshade.golden.result import Result, SceneVerdict
from glshade.golden.results import read

pytest_plugins = ["pytester"]
SAMPLE = Path(__file__).parent / "sample"
# At the end of a run, the plugin `unraisableexception` would collect garbage several times, which takes longer than the tests.
INI = """[pytest]
addopts = -p no:cacheprovider -p no:unraisableexception
glshade_summary = json
"""
HEAD = """
import unittest
from pathlib import Path

import numpy as np
import pytest

import glshade

GREY = np.full((12, 16, 3), 100, dtype=np.uint8)
BALL = Path(__file__).parent / "ball.toml"
compared = pytest.mark.glshade_compare
"""


@pytest.fixture
def project(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A function that writes a test file and runs pytest; without a text, it runs pytest on the same file again."""
    monkeypatch.delenv("CI", raising=False)
    shutil.copyfile(SAMPLE / "ball.toml", pytester.path / "ball.toml")

    (pytester.path / "pytest.ini").write_text(INI, encoding="utf-8")

    def run(text: str = "", *arguments: str) -> pytest.RunResult:
        if text:
            (pytester.path / "test_project.py").write_text(HEAD + dedent(text), encoding="utf-8")
        return pytester.runpytest_inprocess(*arguments)

    return run


@pytest.fixture
def root(pytester: pytest.Pytester) -> Path:
    return pytester.path


def failures(result: pytest.RunResult) -> dict[str, str]:
    """Returns the message of each test that failed or had an error, by the test's name."""
    found: dict[str, str] = {}
    name = ""
    for line in result.outlines:
        if line.startswith("____") and line.endswith("____"):
            name = line.strip("_ ").removeprefix("ERROR at setup of ")
        elif line.startswith(("====", "----", "glshade:")):
            name = ""
        elif name:
            found[name] = f"{found.get(name, '')}{line}\n"
    return found


def told(result: pytest.RunResult) -> list[str]:
    """Returns the lines of the plugin at the end of a run."""
    return [line for line in result.outlines if line.startswith("glshade: ")]


def test_two_tests_with_one_baseline(project: Any) -> None:
    result = project(
        """
        def test_a(render_regression):
            render_regression.check(GREY, name="grey")

        def test_b(render_regression):
            render_regression.check(GREY, name="grey.png")

        def test_twice(render_regression):
            render_regression.check(GREY)
            render_regression.check(GREY)
        """,
        "--glshade-update=missing",
    )
    result.assert_outcomes(passed=1, failed=2)
    found = failures(result)
    assert "test_project.py::test_a and test_project.py::test_b; give each of them a name=" in found["test_b"]
    assert "test_project/test_twice.png twice; give each check a name=" in found["test_twice"]


def test_updates(project: Any, root: Path) -> None:
    text = """
        @compared(name="grey")
        def test_grey():
            return GREY + {change}
        """
    baselines = Baselines(root / "baselines")

    def run(update: str, change: int) -> pytest.RunResult:
        return project(text.format(change=change), f"--glshade-update={update}")

    def baseline() -> bytes:
        return baselines.path("grey.png").read_bytes()

    run("none", 0).assert_outcomes(failed=1)
    (case,) = read(root / "glshade-results")
    assert (case.name, case.missing, case.baseline, case.passed) == ("grey.png", True, None, False)
    assert list(baselines.names()) == []
    result = run("missing", 0)
    result.assert_outcomes(passed=1)
    assert any(line.startswith("glshade: 1 baseline") for line in told(result))
    first = baseline()
    # One code passes, so only "all" writes the picture.
    for update, written in (("none", False), ("missing", False), ("failed", False), ("all", True)):
        run(update, 1).assert_outcomes(passed=1)
        assert (baseline() != first) is written
    for update, passed in (("none", 0), ("missing", 0), ("failed", 1)):
        run(update, 50).assert_outcomes(passed=passed, failed=1 - passed)
    run("none", 50).assert_outcomes(passed=1)
    assert [variant.key for variant in baselines.variants("grey.png")] == [""]


def test_only_two_verdicts_pass(project: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    text = """
        @pytest.mark.parametrize("verdict", ["SAME", "FREEDOM", "BOTH_RIGHT", "STALE", "REGRESSION"])
        def test_verdict(render_regression, verdict):
            render_regression.check(glshade.load(BALL), name=verdict)
        """
    project(text, "--glshade-update=missing").assert_outcomes(passed=5)

    def judged(variants: Any, test: Path, rule: Any, name: str, **options: Any) -> Result:
        verdict = SceneVerdict[name.removesuffix(".png")]
        return Result(name, str(test), verdict.outcome, verdict=verdict, baseline=str(variants[0].path))

    monkeypatch.setattr(checking, "compare_variants", judged)
    result = project("")
    result.assert_outcomes(passed=2, failed=3)
    found = {test.partition("[")[2].rstrip("]"): message.splitlines() for test, message in failures(result).items()}
    assert {verdict: lines[0] for verdict, lines in found.items()} == {
        "BOTH_RIGHT": "changed, both right",
        "STALE": "stale baseline",
        "REGRESSION": "regression",
    }
    assert all("glshade approve glshade-results --only " in lines[-1] for lines in found.values())
    assert {verdict for verdict, lines in found.items() if " --as-variant " in lines[-1]} == {"BOTH_RIGHT"}


def test_a_scene_gets_a_variant_of_its_driver(project: Any, root: Path) -> None:
    project(
        """
        @compared(name="ball")
        def test_ball():
            return np.zeros((30, 40, 3), dtype=np.uint8)
        """,
        "--glshade-update=missing",
    ).assert_outcomes(passed=1)
    result = project(
        """
        def test_ball(render_regression):
            render_regression.check(BALL, name="ball")
        """,
        "--glshade-update=variant",
    )
    result.assert_outcomes(passed=1)
    keys = [variant.key for variant in Baselines(root / "baselines").variants("ball.png")]
    assert len(keys) == 2
    assert "" in keys
    project().assert_outcomes(passed=1)


def test_the_mark_is_refused_where_it_could_have_no_effect(project: Any) -> None:
    result = project(
        """
        @compared
        async def test_async():
            return GREY

        class TestCase(unittest.TestCase):
            @compared
            def test_method(self):
                return GREY

        @compared(tolerance=2)
        def test_argument():
            return GREY

        @compared("exact")
        def test_positional():
            return GREY

        @compared
        def test_nothing():
            GREY.copy()

        @compared(rule="fuzzy")
        def test_rule():
            return GREY

        @compared
        def test_own_error():
            return GREY[99]
        """
    )
    result.assert_outcomes(failed=3, errors=4)
    found = failures(result)
    assert "in an async test, pass the picture to render_regression.check" in found["test_async"]
    assert "unittest.TestCase" in found["TestCase.test_method"]
    assert "takes rule=, name= and mask=, and got tolerance=" in found["test_argument"]
    assert "and got 'exact'" in found["test_positional"]
    assert "None is no picture" in found["test_nothing"]
    assert "rule='fuzzy' is no rule; it must be one of 'codes', 'exact', 'idiff', or a Rule" in found["test_rule"]
    assert "IndexError" in found["test_own_error"], "an error of the test keeps its traceback"


def test_bad_input_fails_with_one_line(project: Any, root: Path) -> None:
    (root / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    (root / "broken.toml").write_text("objects = 3\n", encoding="utf-8")
    result = project(
        """
        @pytest.mark.parametrize("picture", [
            pytest.param("broken.png", id="broken"),
            pytest.param("absent.png", id="absent"),
            pytest.param("absent.toml", id="scene"),
            pytest.param("broken.toml", id="fault"),
            pytest.param("picture.jpg", id="jpg"),
            pytest.param(GREY.astype(np.uint16), id="uint16"),
            pytest.param(GREY[0, 0], id="shape"),
            pytest.param(GREY[:0], id="empty"),
            pytest.param(3.5, id="number"),
            pytest.param(glshade.Image(GREY / 255), id="float64"),
        ])
        def test_picture(render_regression, picture):
            render_regression.check(picture)

        @pytest.mark.parametrize("name", ["../out", "/out", "a@b", ".hidden", "x.jpg", ""])
        def test_name(render_regression, name):
            render_regression.check(GREY, name=name)

        @pytest.mark.parametrize("mask", [GREY[..., 0], GREY[..., 0].astype(bool).ravel()])
        def test_mask(render_regression, mask):
            render_regression.check(GREY, mask=mask)

        @pytest.mark.parametrize(("picture", "overrides"), [(BALL, "film.size"), (BALL, ["nothing=1"]), (GREY, ["a=1"])])
        def test_overrides(render_regression, picture, overrides):
            render_regression.check(picture, overrides=overrides)

        def test_nan(render_regression):
            render_regression.check(np.full((4, 4, 3), np.nan, dtype=np.float32), name="nan.png")

        def test_laws(render_regression):
            render_regression.laws(GREY)
        """,
        "-rN",
    )
    result.assert_outcomes(failed=23)
    found = failures(result)
    assert len(found) == 23
    assert all(message.count("\n") == 1 for message in found.values()), found
    assert "cannot be read as a picture" in found["test_picture[broken]"]
    assert "there is no such file" in found["test_picture[absent]"]
    assert "absent.toml" in found["test_picture[scene]"]
    assert "broken.toml: objects" in found["test_picture[fault]"]
    assert "uint16" in found["test_picture[uint16]"]
    assert "infinite or NaN" in found["test_nan"]
    assert not (root / "baselines").exists()


def test_nan_fails_under_every_rule_and_is_never_a_baseline(project: Any, root: Path) -> None:
    text = """
        @compared
        def test_nan():
            return np.full((4, 4, 3), {value}, dtype=np.float32)
        """
    refused = project(text.format(value="np.nan"), "--glshade-update=missing")
    refused.assert_outcomes(failed=1)
    assert "NaN" in failures(refused)["test_nan"]
    assert list(Baselines(root / "baselines").names()) == []
    project(text.format(value=1), "--glshade-update=missing").assert_outcomes(passed=1)
    project(text.format(value="np.nan")).assert_outcomes(failed=1)


def test_a_scene_file_with_overrides(project: Any, root: Path) -> None:
    project(
        """
        def test_ball(render_regression):
            render_regression.check(BALL, name="small", overrides=["film.size=[20, 15]"])
        """,
        "--glshade-update=missing",
    ).assert_outcomes(passed=1)
    (variant,) = Baselines(root / "baselines").variants("small.png")
    assert variant.sidecar is not None
    assert (variant.sidecar.scene, variant.sidecar.overrides) == ("../ball.toml", ("film.size=[20, 15]",))
    # The sidecar names the scene, by which a picture that the test draws itself is judged.
    result = project(
        """
        def test_ball(render_regression):
            image = glshade.render(glshade.load(BALL, {"film.size": [20, 15], "lights.sky.intensity": 0}))
            render_regression.check(image, name="small")
        """
    )
    result.assert_outcomes(failed=1)
    assert failures(result)["test_ball"].startswith("regression: light sky x 0.00")
    (case,) = read(root / "glshade-results")
    assert case.files.keys() == {"expected", "classes"}


def test_what_a_picture_may_be(project: Any) -> None:
    text = """
        from PIL import Image

        CODES, FLOATS = GREY, GREY / np.float32(255)

        @compared
        @pytest.mark.parametrize("given", [
            CODES, FLOATS, FLOATS.astype(np.float64), FLOATS.astype(np.float16), CODES[..., 0], CODES[..., :1], FLOATS[..., :2],
            np.dstack([CODES, CODES[..., :1]]), glshade.Image(CODES, "srgb"), glshade.Image(FLOATS),
            glshade.Layers(glshade.Image(FLOATS), {"depth": FLOATS[..., :1]}),
            *(Image.fromarray(CODES).convert(mode) for mode in ("1", "L", "LA", "P", "RGB", "RGBA", "F")),
        ], ids=range(18))
        def test_given(given):
            return given

        def test_paths(render_regression, tmp_path):
            glshade.Image(CODES, "srgb").save(tmp_path / "a.png")
            glshade.Image(FLOATS).save(tmp_path / "b.exr")
            render_regression.check(tmp_path / "a.png", name="a")
            render_regression.check(str(tmp_path / "b.exr"), name="b")
            render_regression.same(tmp_path / "a.png", CODES)
            render_regression.same(FLOATS, tmp_path / "b.exr")

        def test_a_float_picture_in_a_png(render_regression):
            render_regression.check(FLOATS, name="c.png")
        """
    project(text, "--glshade-update=missing").assert_outcomes(passed=20)
    project(text).assert_outcomes(passed=20)


def test_a_mask_leaves_pixels_out(project: Any) -> None:
    text = """
        MASK = np.zeros((12, 16), dtype=bool)
        MASK[2:4] = True

        def picture(row, add):
            pixels = GREY.copy()
            pixels[row] += np.uint8(add)
            return pixels

        @compared(mask=MASK)
        def test_inside():
            return picture(2, {add})

        @compared(mask=MASK)
        def test_outside():
            return picture(4, {add})

        @compared(mask=MASK[1:])
        def test_size():
            return picture(0, {add})
        """
    project(text.format(add=0), "--glshade-update=missing")
    result = project(text.format(add=90))
    result.assert_outcomes(passed=1, failed=2)
    assert failures(result).keys() == {"test_outside", "test_size"}


def test_stability_names_what_is_not_deterministic(project: Any) -> None:
    text = """
        from itertools import count

        NUMBER = count()

        @compared
        def test_flickers():
            return GREY + np.uint8(next(NUMBER) % 2)

        @compared
        def test_steady():
            return GREY

        @compared
        def test_nan():
            return np.full((4, 4, 3), np.nan)

        @compared(mask=GREY[..., 0] > 0)
        def test_masked():
            return GREY + np.uint8(next(NUMBER))

        @compared
        def test_layers():
            depth = np.full((12, 16, 1), next(NUMBER), dtype=np.float32)
            return glshade.Layers(glshade.Image(depth.repeat(3, 2) * 0), {"depth": depth})

        def test_scene(render_regression):
            render_regression.check(BALL)

        def test_ready_made(render_regression):
            render_regression.check(GREY)
        """
    refused = project(text, "--glshade-update=missing", "--glshade-stability=3")
    refused.assert_outcomes(passed=4, failed=3)
    found = failures(refused)
    assert "not deterministic: drawing 2 of 3 differs from the first one in the colours" in found["test_flickers"]
    assert "in depth" in found["test_layers"]
    assert "not deterministic" not in found["test_nan"]
    assert any("1 picture given ready-made" in line for line in told(refused))
    project("", "--glshade-update=missing").assert_outcomes(passed=6, failed=1)
    again = project("", "--glshade-stability=2", "-k", "flickers or steady")
    again.assert_outcomes(passed=1, failed=1)
    # A picture that differs from its baseline fails, however steady it is.
    changed = project(text.replace("return GREY\n", "return GREY + 50\n"), "--glshade-stability=2", "-k", "steady")
    changed.assert_outcomes(failed=1)


def test_unused_baselines(project: Any, root: Path) -> None:
    text = """
        @compared
        def test_a():
            return GREY

        @compared
        def test_b():
            return GREY
        """
    strict = "--glshade-disallow-unused"
    project(text, "--glshade-update=missing").assert_outcomes(passed=2)
    assert project("", strict).ret == pytest.ExitCode.OK
    shutil.copyfile(root / "baselines/test_project/test_a.png", root / "baselines/old.png")
    unused = project("", strict)
    assert unused.ret == pytest.ExitCode.TESTS_FAILED
    unused.assert_outcomes(passed=2)
    assert [line for line in told(unused) if line.endswith("delete them: old.png")]

    for arguments in (("-k", "test_a"), ("test_project.py",), ("--ignore=x",), ("--collect-only",)):
        partial = project("", strict, *arguments)
        assert partial.ret == pytest.ExitCode.OK, arguments
        assert any("unused baselines were not looked for" in line for line in told(partial)), arguments
    skipped = project(text.replace("def test_a():", "def test_a():\n            pytest.skip()"), strict)
    assert skipped.ret == pytest.ExitCode.OK
    assert any("1 of the tests with baselines failed or were skipped" in line for line in told(skipped))


def test_without_a_context_the_test_fails(project: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: Any) -> None:
        raise ContextError("no OpenGL context could be made; install libegl1")

    monkeypatch.setattr("glshade.gl.renderer.open_context", refuse)
    result = project(
        """
        def test_scene(render_regression):
            render_regression.check(BALL)

        def test_picture(render_regression):
            render_regression.check(GREY)
        """,
        "--glshade-update=missing",
    )
    result.assert_outcomes(failed=1, passed=1)
    assert failures(result) == {"test_scene": "no OpenGL context could be made; install libegl1\n"}


def test_same_and_laws(project: Any, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from glshade.verification import laws

    broken = laws.Finding("mirrored", "gpu", pixels=100, broken=7, deviation=0.25, allowance=1e-4)
    monkeypatch.setattr(laws, "check_laws", lambda scene, renderer: iter([laws.Finding("rolled", "gpu", pixels=100), broken]))
    result = project(
        """
        def test_same(render_regression):
            render_regression.same(GREY, GREY + 50)

        def test_laws(render_regression):
            render_regression.laws(BALL)
        """
    )
    result.assert_outcomes(failed=2)
    found = failures(result)
    assert "192 pixels differ by more than 1 code" in found["test_same"]
    assert found["test_laws"].startswith("the law mirrored is broken (")
    assert "7 of 100 pixels" in found["test_laws"]
    assert "rolled" not in found["test_laws"]
    assert {path.name for path in (root / "glshade-results" / "same").rglob("*.png")} == {"a.png", "b.png"}


@pytest.mark.parametrize(
    ("option", "value"),
    [("update", "some"), ("summary", "html,pdf"), ("stability", "0"), ("stability", "two")],
)
def test_options_are_checked(project: Any, root: Path, option: str, value: str) -> None:
    result = project("def test(): pass", f"--glshade-{option}={value}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: --glshade-{option}: * is no*"])
    (root / "pytest.ini").write_text(f"[pytest]\nglshade_{option} = {value}\n", encoding="utf-8")
    result = project()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: glshade_{option}: * is no*"])


def test_the_configuration_file_sets_the_options(project: Any, root: Path) -> None:
    (root / "config").mkdir()
    (root / "config" / "pytest.ini").write_text(
        "[pytest]\nglshade_baseline_path = ../approved\nglshade_results_path = out/results\nglshade_update = missing\n"
        "glshade_summary = json, junit\nglshade_stability = 2\nglshade_disallow_unused = true\n",
        encoding="utf-8",
    )
    text = """
        @compared
        def test_a():
            return GREY
        """
    result = project(text, "-c", "config/pytest.ini", "--rootdir=.")
    result.assert_outcomes(passed=1)
    assert (root / "approved" / "test_project" / "test_a.png").is_file()
    results = root / "config" / "out" / "results"
    assert {path.name for path in results.iterdir() if path.is_file()} == {"results.json", "junit.xml"}
    # The command line counts more, and its paths are relative to the folder in which pytest was started.
    result = project("", "-c", "config/pytest.ini", "--rootdir=.", "--glshade-baseline-path=other", "--glshade-update=none")
    result.assert_outcomes(failed=1)
    assert not (root / "other").exists()


def test_a_run_without_pictures_writes_nothing(project: Any, root: Path) -> None:
    before = sorted(root.iterdir())
    result = project("def test(render_regression): pass", "--glshade-summary=html,json,junit")
    result.assert_outcomes(passed=1)
    assert told(result) == []
    assert {path.name for path in root.iterdir()} - {path.name for path in before} <= {"test_project.py", "__pycache__"}


GLSL_TESTS = """#include "math/unit.glsl"

bool test_unit() {
    return abs(length(unit(vec3(3.0, 4.0, 0.0))) - 1.0) < 1e-6;
}

bool test_too_bright(vec3 l, vec3 v) {
    float z = l.z;
    return z > 2.0;
}
"""


def test_glsl_tests_are_collected(pytester: pytest.Pytester, project: Any) -> None:
    (pytester.path / "lobes.test.glsl").write_text(GLSL_TESTS, encoding="utf-8")
    (pytester.path / "none.glsl").write_text(GLSL_TESTS, encoding="utf-8")
    result = project("", "-v")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*lobes.test.glsl::test_unit PASSED*", "*lobes.test.glsl::test_too_bright FAILED*"])
    result.stdout.fnmatch_lines(["float64 on the CPU: false at 4096 of 4096 pairs of directions", "8: z = * in float64, *"])
    assert "Traceback" not in result.stdout.str()


def test_glsl_tests_of_a_folder_of_shaders(pytester: pytest.Pytester, project: Any) -> None:
    (pytester.path / "own" / "math").mkdir(parents=True)
    (pytester.path / "own" / "math" / "half.glsl").write_text("float half_of(float x) {\n    return 0.5 * x;\n}\n")
    text = '#include "math/half.glsl"\n\nbool test_half() {\n    return half_of(4.0) == 2.0;\n}\n'
    (pytester.path / "half.test.glsl").write_text(text, encoding="utf-8")
    project("", "--glshade-shaders", str(pytester.path / "own")).assert_outcomes(passed=1)
    result = project("")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(['*half.test.glsl*no shader file "math/half.glsl"*'])


def test_digits(project: Any) -> None:
    result = project(
        """
        def test_steady(render_regression):
            render_regression.digits("lambert")

        def test_loses(render_regression):
            render_regression.digits(glshade.BRDFS["beckmann"], limit=1e-9)

        def test_unknown(render_regression):
            render_regression.digits("lambart")
        """
    )
    result.assert_outcomes(passed=1, failed=2)
    result.stdout.fnmatch_lines(
        ["*cos_half.glsl:6: loses * of the result: *", '*no model is named *lambart*did you mean "lambert"*']
    )
