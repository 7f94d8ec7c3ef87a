"""Samples: the distributions are what they say, and sample n is the same whatever else was drawn."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats
from support.command import run_command

from glshade.errors import SceneError
from glshade.scene.file import SceneFile
from glshade.scene.sampling import Draw, Sample, Views

COUNT = 4000
# The probability with which a right distribution fails. The seeds are fixed, so that a run does not depend on luck.
P = 1e-3


def _values(draw: Draw, seed: int = 1) -> np.ndarray:
    return np.array([draw.value(seed, number) for number in range(COUNT)])


def test_distributions() -> None:
    uniform = _values(Draw(key="a", uniform=(-2, 5)))
    assert stats.kstest(uniform, "uniform", (-2, 7)).pvalue > P
    logarithms = np.log(_values(Draw(key="a", log_uniform=(0.01, 100))))
    assert stats.kstest(logarithms, "uniform", (np.log(0.01), np.log(1e4))).pvalue > P
    normal = _values(Draw(key="a", normal=(3, 0.5)))
    assert stats.kstest(normal, "norm", (3, 0.5)).pvalue > P
    counts = np.unique(_values(Draw(key="a", choice=("x", "y", "z"))), return_counts=True)[1]
    assert stats.chisquare(counts).pvalue > P


def test_lists_keys_seeds_and_numbers_are_independent() -> None:
    several = _values(Draw(key="a", uniform=((0, 0, 0), (1, 1, 1))))
    columns = [*several.T, _values(Draw(key="b", uniform=(0, 1))), _values(Draw(key="a", uniform=(0, 1)), seed=2)]
    table = np.corrcoef([*columns, np.roll(columns[0], 1)])
    # A correlation of independent numbers is normally distributed with a deviation of 1 / sqrt(COUNT).
    assert np.abs(table - np.eye(len(table))).max() < 5 / np.sqrt(COUNT)


@pytest.mark.parametrize("pattern", ["uniform", "fibonacci", "stratified"])
@pytest.mark.parametrize("on", ["sphere", "hemisphere"])
def test_views_cover_the_sphere(on: Any, pattern: Any) -> None:
    views = Views(on=on, pattern=pattern, count=COUNT)
    found = np.array([views.direction(5, number) for number in range(1, COUNT + 1)])
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)
    heights = (0, 1) if on == "hemisphere" else (-1, 2)
    assert stats.kstest(found[:, 1], "uniform", heights).pvalue > P
    assert stats.kstest(np.arctan2(found[:, 0], found[:, 2]), "uniform", (-np.pi, 2 * np.pi)).pvalue > P


@pytest.mark.parametrize("count", [1, 2, 7, 50, 101])
def test_even_patterns_are_even(count: int) -> None:
    """Each view of a stratified pattern lies in a cell of its own, and the points of a Fibonacci spiral keep their distance."""
    views = Views(pattern="stratified", count=count)
    rows = max(1, round(np.sqrt(count / 2)))
    cells = set()
    for number in range(1, count + 1):
        x, y, z = views.direction(3, number)
        height, angle = (y + 1) / 2, (np.arctan2(x, z) / (2 * np.pi)) % 1
        row = int(np.searchsorted([-(-r * count // rows) / count for r in range(rows + 1)], height, side="right")) - 1
        begin, end = -(-row * count // rows), -(-(row + 1) * count // rows)
        cells.add((row, int(angle * (end - begin))))
    assert len(cells) == count
    spiral = Views(pattern="fibonacci", count=count)
    points = np.array([spiral.direction(0, number) for number in range(1, count + 1)])
    gaps = np.linalg.norm(points[:, None] - points, axis=2) + 9 * np.eye(count)
    # The mean cell has an area of 4 pi / count; a square of a quarter of it is narrower than every gap.
    assert gaps.min() > 0.5 * np.sqrt(4 * np.pi / count)


def test_a_shell_is_filled_evenly() -> None:
    views = Views(radius=(2, 3), target=(1, 2, 3))
    eyes = np.array([views.values(4, number)["camera.eye"] for number in range(COUNT)]) - (1, 2, 3)
    cubes = np.linalg.norm(eyes, axis=1) ** 3
    assert stats.kstest(cubes, "uniform", (8, 19)).pvalue > P


def test_a_sample_does_not_depend_on_the_others() -> None:
    draws = (Draw(key="a", uniform=(0, 1)), Draw(key="b", normal=(0, 1)))
    both, one = Sample(seed=9, values=draws), Sample(seed=9, values=draws[1:])
    assert both.drawn(7)["b"] == one.drawn(7)["b"]
    # The numbers of these draws are part of the format: they must never change.
    assert both.drawn(7) == pytest.approx({"a": 0.6770092718168488, "b": 0.30122459204999397}, rel=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        {"key": "a"},
        {"key": "a", "uniform": (1, 0)},
        {"key": "a", "uniform": (1, 2), "choice": (1,)},
        {"key": "a", "log_uniform": (0, 1)},
        {"key": "a", "normal": (0, -1)},
        {"key": "a", "choice": ()},
        {"key": "a", "uniform": ((1, 2), (3,))},
    ],
)
def test_wrong_distributions(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Draw(**wrong)


SCENE = """
[film]
size = [40, 30]
[sample]
seed = 3
views = { pattern = "stratified", count = 12 }
[[sample.values]]
key = "materials.m.roughness"
uniform = [0.1, 0.9]
[[sample.values]]
key = "objects.c.material"
choice = ["gold", "m"]
[materials.m]
brdf = "ggx"
kd = [0.8, 0.1, 0.1]
[[objects]]
shape = "sphere"
material = "m"
[[objects]]
name = "c"
shape = "cube"
transform = { translate = [1.5, 0, 0] }
"""


def test_a_batch_is_the_same_in_any_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = partial(run_command, capsys)
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(SCENE)
    assert run("render", "s.toml", "-f", "1-12", "-o", "a/##.png", "--jobs", "2").code == 0
    for frames in ("12-7", "1-6"):
        assert run("render", "s.toml", "-f", frames, "-o", "b/##.png", "--jobs", "1", "--overwrite").code == 0
    names = sorted(path.name for path in Path("a").glob("*.png"))
    assert len(names) == 12
    assert all(Path("a", name).read_bytes() == Path("b", name).read_bytes() for name in names)
    assert len({Path("a", name).read_bytes() for name in names}) == 12
    lines = [json.loads(line) for line in Path("a/manifest.jsonl").read_text().splitlines()]
    file = SceneFile("s.toml")
    assert {line["frame"]: line["sample"] for line in lines} == {number: file.drawn(number) for number in range(1, 13)}
    # The printed scene gives the same picture.
    Path("seven.json").write_text(run("sample", "s.toml", "-f", "7").out)
    assert run("render", "seven.json").code == 0
    assert run("compare", "seven.png", "a/07.png", "--rule", "exact").code == 0


def test_a_key_that_names_nothing(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(SCENE.replace("objects.c.material", "objects.d.material"))
    with pytest.raises(SceneError, match=r"sample: objects\.d: no item is named"):
        SceneFile(path).scene(1)
