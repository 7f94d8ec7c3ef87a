"""Works of `glshade bench life`: each runs, and its programs draw the same. No test depends on the speed of the machine."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.bench import life
from glshade.bench.contest import ContestRow, ContestTable
from glshade.bench.life import files
from glshade.bench.life._process import LEAST, MOST, Clocked
from glshade.bench.life.moving import moved
from glshade.bench.life.textures import texture
from glshade.bench.life_contest import measure_life
from glshade.bench.works import BY_HAND, DOOR, GLSHADE, WORKS
from glshade.driver.clock import Spread
from glshade.mesh.file import load

NAMES = list(life.homes())
# pyrender reflects light by another model; moderngl by hand smooths normals otherwise, or does not light its points.
OTHERWISE = {"W8", "W14", "W15"}


def check(name: str, table: ContestTable) -> None:
    """Checks that all programs of a work have a result, and that those by hand draw the same picture."""
    assert table.what == life.work(name).what
    for row in table.rows:
        assert row.fault is None, f"{name}: {row.fault}"
        assert row.seconds is not None
        assert row.peak is not None
        assert row.peak > 5e6
        if row.program.startswith(BY_HAND) and name not in OTHERWISE:
            assert row.same, row


def test_works_have_names_of_their_own_and_glshade_as_first_program() -> None:
    assert not set(NAMES) & set(WORKS)
    assert [name for name in NAMES if name.startswith("W")] == [f"W{number}" for number in range(6, 22)]
    for name in NAMES:
        work = life.work(name)
        assert next(iter(work.programs)) == GLSHADE
        assert work.targets.keys() <= work.programs.keys()
        assert work.over is None or work.over in work.programs


def test_a_new_file_adds_a_work_and_a_name_may_occur_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "further.py").write_text(
        "from glshade.bench.life import LifeWork\nWORKS = {'W99': LifeWork('further', 'process', 1, 1, {'glshade': object})}\n"
    )
    monkeypatch.setattr(life, "__path__", [*life.__path__, str(tmp_path)])
    monkeypatch.setattr(life, "_modules", lambda: ["further", "startup"])
    life.homes.cache_clear()
    try:
        assert list(life.homes()) == ["W20", "W21", "W99"]
        assert life.work("W99").what == "further"
        monkeypatch.setattr(life, "_modules", lambda: ["further", "further"])
        life.homes.cache_clear()
        with pytest.raises(ValueError, match="both have a work W99"):
            life.homes()
    finally:
        life.homes.cache_clear()


def test_programs_without_their_library_are_left_out() -> None:
    programs = {GLSHADE: object, DOOR: object, f"{BY_HAND} tiles": object, "no_such_library": object, "python": object}
    assert life.installed(programs) == [DOOR, f"{BY_HAND} tiles", "python"]


@pytest.mark.parametrize("name", ["W9", "W20"])
def test_a_work_is_measured(name: str) -> None:
    programs = [BY_HAND] if name == "W9" else ["python"]
    check(name, measure_life(name, programs, 1, small=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("W9", "W20", "W21")])
def test_all_programs_of_a_work(name: str) -> None:
    check(name, measure_life(name, life.installed(life.work(name).programs), 1, small=True))


class Slow:
    """A program whose pictures are their numbers."""

    driver = "none"

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds

    def prepare(self, number: int) -> Any:
        return number

    def draw(self, prepared: Any) -> Any:
        return np.full((2, 3, 4, 3), prepared, dtype=np.uint8)


class TestClocked:
    """The time of several pictures."""

    @pytest.fixture
    def now(self, monkeypatch: pytest.MonkeyPatch) -> Any:
        """A clock that moves on by the program's time with each two looks."""

        def start(seconds: float) -> Clocked:
            ticks = iter(float(x) for n in range(1000) for x in (2 * n * seconds, (2 * n + 1) * seconds))
            monkeypatch.setattr("glshade.bench.life._process.perf_counter", lambda: next(ticks))
            return Clocked(Slow(seconds))

        return start

    def test_the_first_is_not_counted_unless_it_takes_too_long_for_a_second(self, now: Any) -> None:
        assert now(0.1).several(5) == pytest.approx([0.1] * 5)
        assert sum(now(0.01).several(5)) == pytest.approx(LEAST, abs=0.02)
        assert now(MOST * 1.5).several(5) == pytest.approx([MOST * 1.5])
        assert len(now(MOST * 0.7).several(5)) == 1

    def test_the_picture_that_is_compared_is_number_0_of_all_programs(self, now: Any) -> None:
        clocked = now(0.2)
        clocked.several(3)
        picture = clocked.picture()
        assert picture.shape == (6, 4, 3)
        assert (picture == 0).all()


class TestInputs:
    """What is new in each picture."""

    def test_each_picture_has_another_texture_and_other_vertices(self) -> None:
        first, second = texture(32, 0), texture(32, 1)
        assert first.shape == (32, 32, 3)
        assert (first != second).any()
        assert (texture(32, 0) == first).all()
        ball = np.eye(3, dtype=np.float32)
        assert moved(ball, 1).dtype == np.float32
        assert (moved(ball, 0) != moved(ball, 3)).any()

    def test_an_obj_file_of_the_stated_size(self, tmp_path: Path) -> None:
        files.written(9, tmp_path)
        text = (tmp_path / files.FILE).read_text()
        assert (text.count("v "), text.count("vn "), text.count("f ")) == (81, 81, 128)
        model = load(tmp_path / files.FILE)
        assert sum(len(part.mesh.triangles) for part in model.parts) == 128


class TestLimits:
    """glshade's time and memory beside their limits."""

    @staticmethod
    def table(ours: float, **options: Any) -> ContestTable:
        rows = [ContestRow(GLSHADE, seconds=Spread(ours, ours, ours)), ContestRow("python", seconds=Spread(1.0, 1.0, 1.0))]
        return ContestTable("start", rows, "s", **options)

    def test_a_program_that_is_subtracted(self) -> None:
        assert self.table(1.5, limit=0.6, over="python").as_dict()["limited_seconds"] == 0.5
        assert self.table(1.5, limit=0.6).as_dict()["limited_seconds"] == 1.5
        assert ContestTable("start", [ContestRow(GLSHADE, fault="no")], "s", limit=1.0, over="python").limited is None

    def test_columns(self) -> None:
        from glshade.bench.report import BenchReport, markdown

        lines = markdown(BenchReport(1, False, {"W20": self.table(1.5, limit=0.6, over="python")})).splitlines()
        assert any("| <= 0.6 s above python, 0.50 s: yes |" in line for line in lines)


class TestCommand:
    """glshade bench life."""

    def test_unknown_names(self, glshade: Any) -> None:
        done = glshade("bench", "life", "W5")
        assert done.returncode == 2
        assert "no work is named 'W5'" in done.stderr

    @pytest.mark.slow
    def test_json(self, glshade: Any) -> None:
        done = glshade("bench", "life", "W20", "--repeat", "1", "--json")
        assert done.returncode == 0, done.stderr
        table = json.loads(done.stdout)["works"]["W20"]
        assert (table["what"], table["limit_seconds"]) == ("`import glshade`", 0.015)
        assert [row["program"] for row in table["rows"]] == [GLSHADE, "python"]
        assert all(row["peak_bytes"] > 5e6 for row in table["rows"])


def test_every_module_is_imported_without_its_peers() -> None:
    for module in set(life.homes().values()):
        assert importlib.import_module(f"glshade.bench.life.{module}").WORKS
