"""`glshade compare`: its lines, its reports and its exit codes."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from support.command import run_command

import glshade
from glshade.image import file as picture_file
from glshade.image.contents import PictureContents

GREY = np.full((20, 30, 3), 100, dtype=np.uint8)


def write(path: str, pixels: Any = GREY) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    encoding = "srgb" if pixels.dtype == np.uint8 else "linear"
    picture_file.write(Path(path), PictureContents(pixels, encoding, premultiplied=False))


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function `run(*arguments)` that runs `glshade compare` in a folder with pictures.

    same.png has the pixels of ref.png, near.png differs by one code, and far.png by 51 codes in 15 pixels.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    far = GREY.copy()
    far[5, :15] += 51
    for name, pixels in (("ref", GREY), ("same", GREY), ("near", GREY + 1), ("far", far), ("small", GREY[:9])):
        write(f"{name}.png", pixels)
    return partial(run_command, capsys, "compare")


FAR = "15 pixels differ by more than 1 code, and at most 4 may"
FIGURES = "max 0.2, RMSE 0.0316, p99.9 0.2, 45 codes differ"


def test_two_files(run: Any) -> None:
    assert run("ref.png", "same.png") == (0, "same   same.png\n", "")
    code, out, err = run("ref.png", "near.png")
    assert (code, err) == (0, "")
    assert out.startswith("same   near.png: max 0.00392, ")
    assert run("ref.png", "far.png") == (2, f"fail   far.png: {FAR}; {FIGURES}\n", "")
    assert run("ref.png", "small.png") == (3, "sizes  small.png: the sizes are 30x20 and 30x9 pixels\n", "")
    code, out, err = run("ref.png", "absent.png")
    assert (code, err) == (4, "")
    assert out == "file   absent.png: cannot be read: No such file or directory\n"


def test_rules(run: Any) -> None:
    assert run("ref.png", "near.png", "--rule", "exact").code == 2
    assert run("ref.png", "near.png", "--rule", "codes").code == 0
    assert run("ref.png", "near.png", "--rule", "idiff").code == 2
    assert run("ref.png", "near.png", "--fail", "0.01").code == 0
    assert run("ref.png", "near.png", "--failpercent", "100").code == 1
    assert (
        run("ref.png", "far.png", "--fail", "0.01", "--failpercent", "2.5", "--warn", "0.01", "--warnpercent", "2.4").code == 1
    )
    assert run("ref.png", "far.png", "--allowfailures", "15").code == 0
    assert run("ref.png", "far.png", "--allowfailures", "14").code == 2


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("ref.png",),
        ("ref.png", "same.png", "--wrong"),
        ("ref.png", "same.png", "--rule", "exactly"),
        ("ref.png", "same.png", "--rule", "codes", "--fail", "0.1"),
        ("ref.png", "same.png", "--fail", "much"),
        ("ref.png", "same.png", "--hardwarn", "nan"),
        ("ref.png", "same.png", "--allowfailures", "-1"),
        ("ref.png", "same.png", "--json", "--github"),
        ("ref.png", "same.png", "--diff", "x.txt"),
        ("ref.png", "."),
        (".", ".", "--diff", "x.png"),
    ],
    ids=" ".join,
)
def test_wrong_usage_is_64(arguments: tuple[str, ...], run: Any) -> None:
    result = run(*arguments)
    assert (result.code, result.out) == (64, "")
    assert "Error: " in result.err


@pytest.mark.parametrize("option", ["--diff", "--junit"])
@pytest.mark.parametrize("path", ["ref.png", "far.png", "./a/../far.png", "link.png", "hard.png"])
def test_no_output_replaces_a_compared_picture(option: str, path: str, run: Any) -> None:
    Path("a").mkdir()
    Path("link.png").symlink_to("ref.png")
    Path("hard.png").hardlink_to("ref.png")
    before = {name: Path(name).read_bytes() for name in ("ref.png", "far.png")}
    result = run("ref.png", "far.png", option, path)
    assert result.code == 64
    assert f"{option} would replace " in result.err
    assert before == {name: Path(name).read_bytes() for name in before}


def test_no_output_becomes_a_compared_picture(run: Any) -> None:
    write("a/x.png")
    write("b/x.png")
    Path("link").symlink_to("b")
    for path in ("a/report.xml", "link/report.xml"):
        result = run("a", "b", "--junit", path)
        assert result.code == 64
        assert "whose files are compared" in result.err
    assert run("a", "b", "--junit", "ab.xml").code == 0


def test_the_rule_of_the_sidecar_counts_unless_another_is_named(run: Any, capsys: pytest.CaptureFixture[str]) -> None:
    Path("base").mkdir()
    write("out/a.png")
    assert run("base", "out", "--rule", "exact", "--report", "results").code == 4
    assert run_command(capsys, "approve", "results").code == 0
    write("out/a.png", GREY + 1)
    assert run("base", "out").out.startswith("fail   a.png: 600 of 600 pixels differ; ")
    assert run("base", "out", "--rule", "codes").code == 0
    sidecar = Path("base/a.png.glshade.json")
    sidecar.write_text(sidecar.read_text(encoding="utf-8").replace('"exact"', '"exakt"'), encoding="utf-8")
    code, out, _ = run("base", "out", "--report", "results")
    assert code == 4
    assert out.startswith("file   a.png: the sidecar of base/a.png cannot be used: no rule is named 'exakt'")


def test_a_named_rule_judges_in_place_of_the_scene_of_the_sidecar(run: Any) -> None:
    """The baseline by the reference and the picture of a driver differ by rounding alone, which its scene allows."""
    baseline = Path(__file__).resolve().parents[2] / "baselines" / "shading-rates.png"
    overrides = json.loads(baseline.with_name(baseline.name + ".glshade.json").read_text(encoding="utf-8"))["overrides"]
    scene = glshade.load(baseline.parents[2] / "scenes" / "shading-rates.toml", [text.split("=", 1) for text in overrides])
    pixels = glshade.reference.render(scene).encoded().pixels.copy()
    pixels[10, 10:20] += 1
    write("near.png", pixels)
    assert run(baseline, "near.png").code == 0
    assert run(baseline, "near.png", "--rule", "exact").code == 2


def test_flip_is_told_and_judges_if_it_is_asked_for(run: Any) -> None:
    assert "FLIP" not in run("ref.png", "near.png").out
    assert run("ref.png", "near.png", "--flip") == (
        0,
        "same   near.png: max 0.00392, RMSE 0.00392, p99.9 0.00392, FLIP 0.0308, 1800 codes differ\n",
        "",
    )
    code, out, _ = run("ref.png", "near.png", "--max-flip", "0.001", "--json")
    assert code == 2
    assert json.loads(out)["pairs"][0]["reason"] == "FLIP is 0.0308, and at most 0.001 is allowed"
    assert run("ref.png", "near.png", "--max-flip", "0.04").code == 0
    assert run("ref.png", "far.png", "--max-flip", "1").code == 2
    assert run("ref.png", "near.png", "--max-flip", "nan").code == 64


def test_libpng_does_not_print(tmp_path: Path) -> None:
    """libpng prints its errors to the process's standard error, whatever the program does with them."""
    write(str(tmp_path / "ref.png"))
    (tmp_path / "cut.png").write_bytes((tmp_path / "ref.png").read_bytes()[:-20])
    arguments = [sys.executable, "-m", "glshade", "compare", "ref.png", "cut.png"]
    done = subprocess.run(arguments, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (4, "")
    assert done.stdout.startswith("file   cut.png: cannot be read as a picture: ")
    assert done.stdout.count("\n") == 1


def test_names_that_are_too_long_are_files(run: Any) -> None:
    long = "x" * 5000 + ".png"
    for arguments in (("ref.png", long), (long, "ref.png")):
        code, out, err = run(*arguments)
        assert (code, err) == (4, "")
        assert out.endswith("File name too long\n")


def test_an_error_outside_the_comparison_is_not_a_warning(run: Any) -> None:
    result = run("ref.png", "same.png", "--junit", "absent/report.xml")
    assert (result.code, result.err) == (4, "glshade: absent/report.xml: cannot be written: No such file or directory\n")
    Path("a").mkdir()
    assert run("a", "a") == (4, "", "glshade: a and a hold no files to compare\n")


@pytest.fixture
def folders(run: Any) -> None:
    """Two folders with a pair of each outcome, and names that reports must not obey."""
    far = GREY.copy()
    far[5, :15] += 51
    for name, pixels in (
        ("same.png", GREY),
        ("a|<b> & %,:*.png", far),
        ("sizes/small.png", GREY[:9]),
        ("line\nbreak\x1b.png", far),
    ):
        write(f"ref/{name}")
        write(f"test/{name}", pixels)
    write("ref/cut.png")
    Path("test/cut.png").write_bytes(Path("ref/cut.png").read_bytes()[:40])
    write("test/only.png")


@pytest.mark.usefixtures("folders")
class TestFolders:
    """Two folders with a pair of each outcome."""

    def test_lines(self, run: Any) -> None:
        code, out, _ = run("ref", "test")
        assert code == 4
        lines = out.splitlines()
        assert lines[0] == f"fail   a|<b> & %,:*.png: {FAR}; {FIGURES}"
        assert lines[1].startswith("file   cut.png: test/cut.png: cannot be read as a picture: ")
        assert lines[2:] == [
            f"fail   line\\u000abreak\\u001b.png: {FAR}; {FIGURES}",
            "file   only.png: is only in the test folder test",
            "sizes  sizes/small.png: the sizes are 30x20 and 30x9 pixels",
            "6 pairs: 1 same, 2 fail, 1 sizes, 2 file",
        ]

    def test_the_exit_code_is_that_of_the_worst_pair(self, run: Any) -> None:
        for name in ("cut.png", "only.png"):
            Path("test", name).unlink()
        Path("ref/cut.png").unlink()
        assert run("ref", "test").code == 3
        Path("test/sizes/small.png").unlink()
        Path("ref/sizes/small.png").unlink()
        assert run("ref", "test").code == 2
        assert run("ref", "test", "--failpercent", "5").code == 1
        assert run("ref", "test", "--allowfailures", "15").code == 0

    def test_json(self, run: Any) -> None:
        code, out, _ = run("ref", "test", "--json")
        report = json.loads(out)
        assert code == 4
        assert (report["rule"], report["outcome"]) == ("codes", "file")
        assert [pair["outcome"] for pair in report["pairs"]] == ["fail", "file", "fail", "file", "same", "sizes"]
        (layer,) = report["pairs"][0]["layers"]
        assert layer["metrics"]["codes"] == 45
        assert layer["metrics"]["worst"] == pytest.approx(0.2)

    def test_report(self, run: Any) -> None:
        """The report has every pair, also those with a file that cannot be read, and its page obeys no name."""
        Path("test/memory.png").symlink_to("/proc/self/mem")
        write("ref/memory.png")
        assert run("ref", "test", "--report", "report").code == 4
        cases = json.loads(Path("report/results.json").read_text(encoding="utf-8"))["cases"]
        assert sorted(case["outcome"] for case in cases) == ["fail", "fail", "file", "file", "file", "same", "sizes"]
        page = Path("report/index.html").read_text(encoding="utf-8")
        assert "a|&lt;b&gt;" in page
        assert "a|<b>" not in page

    def test_junit(self, run: Any) -> None:
        run("ref", "test", "--junit", "report.xml")
        suite = ElementTree.parse("report.xml").getroot()[0]
        assert {key: suite.get(key) for key in ("tests", "failures", "errors")} == {
            "tests": "6",
            "failures": "3",
            "errors": "2",
        }
        assert {case.get("name"): [child.tag for child in case] for case in suite} == {
            "a|<b> & %,:*.png": ["failure"],
            "cut.png": ["error"],
            "line\\u000abreak\\u001b.png": ["failure"],
            "only.png": ["error"],
            "same.png": [],
            "sizes/small.png": ["failure"],
        }

    def test_github(self, run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        Path("summary.md").write_text("before\n")
        monkeypatch.setenv("GITHUB_STEP_SUMMARY", "summary.md")
        annotations = [line for line in run("ref", "test", "--github").out.splitlines() if line.startswith("::")]
        assert len(annotations) == 5
        title = "title=glshade compare%3A fail"
        assert f"::error file=test/a|<b> & %25%2C%3A*.png,{title}::fail   a|<b> & %25,:*.png: {FAR}; {FIGURES}" in annotations
        summary = Path("summary.md").read_text()
        assert summary.startswith("before\n### glshade compare\n\n6 pairs: ")
        assert "| fail | a&#124;&#60;b&#62; &#38; &#37;&#44;&#58;&#42;.png | " in summary
        rows = [line for line in summary.splitlines() if line.startswith("| ")]
        assert len(rows) == 6
        assert {line.count("|") for line in rows} == {8}


def test_the_difference_as_a_picture(run: Any) -> None:
    assert run("ref.png", "far.png", "--diff", "diff.png").code == 2
    (part,) = picture_file.parts("diff.png")
    pixels = picture_file.read_part("diff.png", part)
    expected = np.zeros_like(GREY)
    expected[5, :15] = 255
    np.testing.assert_array_equal(pixels, expected)
    assert run("ref.png", "far.png", "--diff", "diff.exr").code == 2
    (part,) = picture_file.parts("diff.exr")
    np.testing.assert_allclose(picture_file.read_part("diff.exr", part).max(), 0.2, rtol=1e-6)
    assert run("ref.png", "same.png", "--diff", "none.png").code == 0
    assert run("ref.png", "small.png", "--diff", "none.png").code == 3
    assert not Path("none.png").exists()


def test_a_difference_that_is_not_finite_is_white(run: Any) -> None:
    pixels = np.full((20, 30, 3), 0.5, dtype=np.float32)
    pixels[3, 4] = (np.inf, 0.5, 0.5)
    write("a.exr", pixels)
    pixels[3, 4] = (np.inf, np.nan, 0.5)
    write("b.exr", pixels)
    assert run("a.exr", "b.exr", "--diff", "diff.png").code == 2
    (part,) = picture_file.parts("diff.png")
    assert picture_file.read_part("diff.png", part)[3, 4].tolist() == [255, 255, 255]
