"""The pictures that a command makes, and the names of their files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from glshade.batch.frames import Sweep, check_count, parse, parse_sweep, pictures
from glshade.cli import cli
from glshade.image.file import read
from glshade.scene.file import SceneFile

SCENE = """
objects = [ { name = "ball", shape = "cube", material = "red" } ]
animation = [ { key = "camera.turn", frames = [1, 5], values = [0, 360] },
  { key = "materials.red.kd", frames = [1, 3], values = [0, 1] } ]
lights = [ { type = "ambient" } ]
[materials]
red = { brdf = "lambert" }
[film]
size = [16, 12]
[cameras]
top = { eye = [0, 5, 0.1], target = [0, 0, 0] }
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SceneFile:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(SCENE)
    return SceneFile("s.toml")


@given(first=st.integers(-50, 50), count=st.integers(1, 60), step=st.integers(1, 9))
def test_ranges_are_parsed(first: int, count: int, step: int) -> None:
    last = first + count - 1
    expected = list(range(first, last + 1, step))
    assert parse(f"{first}-{last}x{step}") == expected
    assert parse(f"{first}..{last}x{step}") == expected


@pytest.mark.parametrize("text", ["", "a", "1-z", "1-10x0"])
def test_invalid_ranges(text: str) -> None:
    with pytest.raises(ValueError, match=r"range|frames"):
        parse(text)


def test_file_names(file: SceneFile) -> None:
    def names(*arguments: Any) -> list[str]:
        return [str(picture.output) for picture in pictures([file.path], *arguments)]

    assert names(None, (), None) == ["s.png"]
    assert names([1, 20], (), None) == ["s.0001.png", "s.0020.png"]
    assert names([1], ("top",), None) == ["s.top.0001.png"]
    assert names([7, -7, 123], (), "out/{scene}_#.exr") == ["out/s_7.exr", "out/s_-7.exr", "out/s_123.exr"]
    assert names([5], ("top",), "{camera}/##.png") == ["top/05.png"]


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (([1, 2], (), "x.png"), "lacks #"),
        ((None, ("a", "b"), "x.png"), "lacks {camera}"),
        ((None, (), "x.#.png"), "there are no frames: add --frames"),
        (([1], (), "{frame}.png"), "{frame} is not known"),
        ((None, (), "x.png", [Sweep("a.b", ("1", "2"))]), "lacks {a.b}"),
        (
            (None, (), "{x}{b}.png", [Sweep("a.b", ("1",)), Sweep("c.b", ("1",))]),
            "{b} is not known; known: {scene}, {camera}, {a.b}, {c.b} and",
        ),
        ((None, (), "{b}.png", [Sweep("a.b", ("1 2", "1/2"))]), "several pictures the same name"),
    ],
)
def test_invalid_patterns(file: SceneFile, arguments: Any, fault: str) -> None:
    with pytest.raises(ValueError, match=re.escape(fault)):
        list(pictures([file.path], *arguments))


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a.b=1,2,3", ("1", "2", "3")),
        ("a.b = [1, 2], [3,4] ", ("[1, 2]", "[3,4]")),
        ('a.b="x,y",z', ('"x,y"', "z")),
        ("a.b={k=[1,2],l=3},4", ("{k=[1,2],l=3}", "4")),
    ],
)
def test_sweeps_are_parsed(text: str, values: tuple[str, ...]) -> None:
    assert parse_sweep(text) == Sweep("a.b", values)


@pytest.mark.parametrize("text", ["a.b", "a.b=", "a.b=1,,2", "a.b=1,[2", "=1,2"])
def test_invalid_sweeps(text: str) -> None:
    with pytest.raises(ValueError, match=r"KEY=VALUE|not a value"):
        parse_sweep(text)


def test_every_combination_of_sweeps_has_a_name_of_its_own(file: SceneFile) -> None:
    sweeps = [Sweep("materials.red.kd", ("0.1", "[1, 0, 0]")), Sweep("film.samples", ("1", "4"))]

    def names(*arguments: Any) -> list[str]:
        return [str(picture.output) for picture in pictures([file.path], *arguments)]

    assert names(None, (), None, sweeps) == [
        "s.kd-0.1.samples-1.png",
        "s.kd-0.1.samples-4.png",
        "s.kd-1_0_0.samples-1.png",
        "s.kd-1_0_0.samples-4.png",
    ]
    assert names(None, (), "{samples}/{materials.red.kd}.png", sweeps)[:3] == ["1/0.1.png", "4/0.1.png", "1/1_0_0.png"]
    assert names([3], ("top",), None, sweeps[1:]) == ["s.samples-1.top.0003.png", "s.samples-4.top.0003.png"]
    both = [Sweep("a.kd", ("1",)), Sweep("b.kd", ("2",))]
    assert names(None, (), None, both) == ["s.a.kd-1.b.kd-2.png"]
    shots = list(pictures([file.path], None, (), None, sweeps))
    assert shots[1].overrides == (("materials.red.kd", "0.1"), ("film.samples", "4"))


def test_placeholders_in_the_name_of_a_scene_are_not_replaced() -> None:
    (picture,) = pictures([Path("a#{camera}.toml")], [7], (), "{scene}.##.png")
    assert picture.output == Path("a#{camera}.07.png")


def test_frames_share_objects_that_are_not_animated(file: SceneFile) -> None:
    second, third = file.scene(2), file.scene(3)
    assert second.objects[0] is third.objects[0]
    assert second.materials["red"] is not third.materials["red"]
    still = SceneFile("s.toml", {"animation": []})
    assert still.scene(1) is still.scene(2)
    assert still.scene(1, "top") is still.scene(2, "top")


def test_the_scene_at_a_frame_through_a_camera(file: SceneFile) -> None:
    assert file.cameras == ("top",)
    assert file.scene(2).camera.turn == 90
    assert file.scene(2).materials["red"].kd == (0.5, 0.5, 0.5)  # type: ignore[attr-defined]
    assert file.scene(2, "top").camera.eye == (0, 5, 0.1)
    assert file.scene().camera.turn == 0


def test_a_batch(file: SceneFile) -> None:
    def run(*arguments: str) -> Any:
        return CliRunner().invoke(cli, ["render", "s.toml", *arguments])

    assert run("-f", "1-3", "-o", "f.##.png").exit_code == 0
    dark, bright = (read(f"f.{n}.png")[0][..., :3] for n in ("01", "03"))
    assert dark.max() < bright.max() == 1
    again = run("-f", "2-4", "-o", "f.##.png")
    assert again.exit_code == 2
    assert "f.02.png and 1 more exists" in again.output
    assert not Path("f.04.png").exists()
    before = Path("f.02.png").stat().st_mtime_ns
    skipped = run("-f", "2-4", "-o", "f.##.png", "--skip-existing")
    assert skipped.stdout.split() == ["f.04.png"]
    assert Path("f.02.png").stat().st_mtime_ns == before
    assert sorted(run("-f", "2-4", "-o", "f.##.png", "--overwrite").stdout.split()) == ["f.02.png", "f.03.png", "f.04.png"]
    assert run("-f", "2", "-o", "f.##.png").exit_code == 0, "a single picture replaces its file"
    assert np.array_equal(read("f.03.png")[0][..., :3], bright)


@pytest.mark.parametrize("name", ["..", ".", "/etc/x", "a/../../b", "..\\x", "../../../x"])
def test_no_name_leads_out_of_the_folder(name: str) -> None:
    sweeps = [Sweep("a.b", (name,))]
    for pattern in ("out/{camera}/x.png", "out/{camera}.png", "out/{b}/x.png", "out/{a.b}.png"):
        (picture,) = pictures([Path("s.toml")], None, [name], pattern, sweeps)
        assert Path("out").resolve() in picture.output.resolve().parents
        assert len(picture.output.parts) == len(Path(pattern).parts)


def test_tasks_are_counted_before_they_are_listed() -> None:
    check_count(2, 0, 10, [Sweep("a", ("1", "2"))], 40)
    with pytest.raises(ValueError, match="give 120 pictures; 119 are allowed"):
        check_count(2, 3, 10, [Sweep("a", ("1", "2"))], 119)
