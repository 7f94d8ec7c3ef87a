"""glshade bench: the works that other programs do too. Nothing here is timed: whether it measures what it says."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade import Renderer, load
from glshade.bench import peers
from glshade.bench.contest import SAME, Row, apart, contest, in_turn, row, target
from glshade.bench.entrants import Cold, Files, ProgramError, Took, enter, pictures_took, read_codes
from glshade.bench.growth import AN_OBJECT, SERIES, Growth, fitted, growth
from glshade.bench.jobs import Jobs
from glshade.bench.report import SCHEMA, Report, markdown
from glshade.bench.stage import TURN, Stage, eye, set_up, sphere
from glshade.bench.works import BY_HAND, FASTEST, GLSHADE, WORKS, Work
from glshade.driver.clock import Spread
from glshade.scene.file import SceneFile

SMALL = {name: work.small() for name, work in WORKS.items()}
needs_pillow = pytest.mark.skipif(importlib.util.find_spec("PIL") is None, reason="the program by hand writes PNG by Pillow")


class TestStage:
    """One scene in two forms."""

    def test_shuffled_triangles_are_the_same_surface(self) -> None:
        (p, t), (q, u) = sphere(3), sphere(3, scattered=True)
        # A triangle turned round its corners is the same one; the sum of its corners tells it from the others.
        assert sorted(map(tuple, p[t].sum(axis=1, dtype=float).round(5))) == sorted(
            map(tuple, q[u].sum(axis=1, dtype=float).round(5))
        )
        outward = np.einsum("ti,ti->t", np.cross(q[u[:, 1]] - q[u[:, 0]], q[u[:, 2]] - q[u[:, 0]]), q[u[:, 0]])
        assert (outward > 0).all()

        def step(positions: Any, triangles: Any) -> float:
            return float(np.linalg.norm(np.diff(positions[triangles].mean(axis=1), axis=0), axis=1).mean())

        assert step(q, u) > 5 * step(p, t)

    @pytest.mark.parametrize("name", WORKS)
    def test_the_scene_file_is_a_scene(self, name: str, tmp_path: Path) -> None:
        stage = Stage.load(str(set_up(SMALL[name], tmp_path)))
        scene = load(stage.scene)
        assert scene.film.size == (stage.side, stage.side)
        assert len(scene.lights) == {"directional": 2, "points": 9}[stage.lights]
        positions, triangles = stage.arrays()
        assert np.allclose(np.linalg.norm(positions, axis=1), 1, atol=1e-6)
        assert len(triangles) == 20 * 4 ** SMALL[name].subdivisions

    def test_the_turntable_turns_as_the_other_programs_do(self, tmp_path: Path) -> None:
        stage = Stage.load(str(set_up(WORKS["W4"].small(), tmp_path)))
        for frame in (1, 2, 3):
            camera = SceneFile(Path(stage.scene)).scene(frame).camera
            angle = np.radians(camera.turn)
            assert np.allclose(eye(frame), (3 * np.sin(angle), 0, 3 * np.cos(angle)))
        assert np.allclose(eye(TURN + 1), eye(1))


class TestPrograms:
    """Those that draw beside glshade."""

    def test_the_one_by_hand_is_first_and_always_there(self) -> None:
        assert peers.installed()[0] == BY_HAND
        assert set(peers.installed()) <= set(peers.NAMES)
        assert {"mitsuba", "moderngl", "panda3d", "pyrender", "vtk"} <= set(peers.NAMES)

    @pytest.mark.parametrize("name", ["W1", "W2"])
    def test_by_hand_it_is_the_same_picture(self, name: str) -> None:
        ours, hand = contest(SMALL[name], [BY_HAND], repeat=1)
        assert (ours.program, hand.program) == (GLSHADE, BY_HAND)
        assert ours.driver == hand.driver
        assert hand.codes is not None
        assert hand.codes <= SAME
        assert hand.target == WORKS[name].targets[BY_HAND]
        assert ours.seconds is not None
        assert hand.seconds is not None
        assert hand.ratio is not None
        # One round: the ratio is that of the times.
        assert hand.ratio.median == pytest.approx(ours.seconds.median / hand.seconds.median)

    @needs_pillow
    def test_files_are_the_frames_of_the_turntable(self, tmp_path: Path, renderer: Renderer) -> None:
        work = WORKS["W4"].small()
        stage = set_up(work, tmp_path)
        entrant = Files(BY_HAND, work, stage, tmp_path)
        took = entrant.round()
        assert took.whole is not None
        assert 0 < took.seconds < took.whole
        assert sorted(path.name for path in (tmp_path / "frames").iterdir()) == ["0001.png", "0002.png", "0003.png"]
        scenes = SceneFile(Path(Stage.load(str(stage)).scene))
        assert apart(entrant.picture(), renderer.render(scenes.scene(work.frames)).pixels) <= SAME
        assert apart(entrant.picture(), renderer.render(scenes.scene(1)).pixels) > SAME

    @needs_pillow
    def test_a_cold_start_leaves_the_picture(self, tmp_path: Path) -> None:
        stage = set_up(SMALL["W5"], tmp_path)
        pictures = []
        for name in (GLSHADE, BY_HAND):
            (tmp_path / name).mkdir()
            entrant = Cold(name, SMALL["W5"], stage, tmp_path / name)
            assert entrant.round().seconds > 0
            pictures.append(entrant.picture())
        assert apart(*pictures) <= SAME

    @pytest.mark.slow
    def test_every_peer_that_is_installed(self) -> None:
        rows = {found.program: found for found in contest(SMALL["W1"], peers.installed(), repeat=1)}
        assert set(rows) == {GLSHADE, *peers.installed()}
        for name in {"moderngl", "panda3d", "vtk"} & set(rows):
            assert rows[name].same, rows[name]
        for name in {"mitsuba", "pyrender"} & set(rows):
            # Mitsuba wants an LLVM that the machine may lack.
            assert rows[name].codes is not None or rows[name].fault, rows[name]
            assert not rows[name].same

    def test_a_program_that_ends_early_says_why(self, tmp_path: Path) -> None:
        stage = set_up(SMALL["W1"], tmp_path)
        with pytest.raises(ProgramError, match=r"nobody ended early: .*No module named 'glshade.bench.peers.nobody'"):
            enter("nobody", SMALL["W1"], stage, tmp_path)
        with pytest.raises(ProgramError, match="nobody ended early"):
            Cold("nobody", SMALL["W5"], stage, tmp_path).round()
        fault = contest(SMALL["W1"], ["nobody"], repeat=1)[1]
        assert (fault.program, fault.seconds) == ("nobody", None)
        assert fault.fault

    def test_what_a_command_says_of_its_pictures(self) -> None:
        assert pictures_took([{"event": "begin"}, {"event": "end", "seconds": 3.0, "seconds_pictures": 2.5}]) == 2.5
        with pytest.raises(ProgramError, match="did not say"):
            pictures_took([{"event": "end", "seconds": 3.0}])

    def test_no_picture_is_a_fault(self, tmp_path: Path) -> None:
        (tmp_path / "x.png").write_bytes(b"not a picture")
        with pytest.raises(ProgramError, match="not a picture"):
            read_codes(tmp_path / "x.png")


class Fake:
    """An entrant whose times are given; an exception among them is raised."""

    driver = None

    def __init__(self, name: str, log: list[str], *took: float | Exception) -> None:
        self._name, self._log, self._took = name, log, iter(took)

    def round(self) -> Took:
        self._log.append(self._name)
        found = next(self._took)
        if isinstance(found, Exception):
            raise found
        return Took(found)

    def picture(self) -> Any:
        return np.zeros((1, 1, 3), dtype=np.uint8)

    def close(self) -> None:
        pass


class TestRounds:
    """Programs in turn, and what is made of their times."""

    def test_the_first_round_is_not_counted_and_who_begins_changes(self) -> None:
        log: list[str] = []
        entrants = {GLSHADE: Fake(GLSHADE, log, 99, 1, 2), "b": Fake("b", log, 98, 3, 4)}
        took = in_turn(entrants, 2, {})
        assert took == {GLSHADE: [Took(1), Took(2)], "b": [Took(3), Took(4)]}
        assert log == [GLSHADE, "b", "b", GLSHADE, GLSHADE, "b"]

    def test_who_fails_is_out_unless_it_is_glshade(self) -> None:
        log: list[str] = []
        faults: dict[str, str] = {}
        broken = Fake("b", log, 1, ProgramError("b ended early: oh"))
        assert in_turn({GLSHADE: Fake(GLSHADE, log, 9, 1, 2), "b": broken}, 2, faults) == {GLSHADE: [Took(1), Took(2)]}
        assert faults == {"b": "b ended early: oh"}
        with pytest.raises(ProgramError):
            in_turn({GLSHADE: Fake(GLSHADE, log, ProgramError("no"))}, 1, {})

    def test_ratios_are_of_the_same_round(self) -> None:
        took = {GLSHADE: [Took(1.0), Took(4.0), Took(2.0)], "b": [Took(2.0), Took(4.0), Took(8.0)]}
        assert row("b", took, None, 0).ratio == Spread(0.5, 0.25, 1.0)
        assert row(GLSHADE, took, None, 0).ratio is None
        assert row("b", took, None, 0).whole is None
        whole = {GLSHADE: [Took(1.0, 3.0)], "b": [Took(2.0, 5.0)]}
        assert row("b", whole, None, 0).whole == Spread(5.0, 5.0, 5.0)

    def test_targets_are_of_the_program_the_fastest_or_all_with_the_same_picture(self) -> None:
        def done(name: str, seconds: float, codes: int = 0) -> Row:
            return Row(name, seconds=Spread(seconds, seconds, seconds), codes=codes)

        rows = [done(GLSHADE, 1), done("b", 2), done("c", 3), done("d", 4, codes=9)]
        work = Work("", targets={"c": 0.5, "d": 0.3, FASTEST: 0.4})
        assert [target(work, one, rows) for one in rows] == [None, 0.4, 0.5, 0.3]
        work = Work("", targets={"c": 0.5, "peers": 1.0})
        assert [target(work, one, rows) for one in rows] == [None, 1.0, 0.5, None]

    def test_a_target_is_met_or_not(self) -> None:
        at = Spread(0.5, 0.1, 0.9)
        assert Row("b", ratio=at, target=0.5).met is True
        assert Row("b", ratio=at, target=0.49).met is False
        assert Row("b", ratio=at).met is None

    def test_pictures_are_the_same_to_one_code(self) -> None:
        a = np.array([[[0, 255, 3]]], dtype=np.uint8)
        assert apart(a, a) == 0
        assert apart(a, np.array([[[1, 254, 3]]], dtype=np.uint8)) == 1
        assert apart(a, np.array([[[255, 255, 3]]], dtype=np.uint8)) == 255
        assert apart(a, a[:, :0]) == 255
        assert [Row("b", codes=codes).same for codes in (None, 0, 1, 2)] == [False, True, True, False]


class TestGrowth:
    """Exponents."""

    def test_the_exponent_is_that_of_the_power_law(self) -> None:
        sizes = [1, 10, 100, 1000]
        for exponent in (0.0, 0.5, 1.0, 2.0):
            assert fitted(sizes, [3.0 * size**exponent for size in sizes]) == pytest.approx(exponent)

    @staticmethod
    def series(what: str, *seconds: float) -> Growth:
        return Growth(what, tuple(10**i for i in range(len(seconds))), tuple(Spread(s, s, s) for s in seconds))

    def test_what_every_frame_costs_does_not_hide_growth_at_the_end(self) -> None:
        linear = self.series("lights", *(1 + 1e-3 * 10**i for i in range(5)))
        assert linear.each == pytest.approx(1e-3)
        assert linear.met
        square = self.series("lights", *(1 + 1e-6 * 100**i for i in range(5)))
        assert square.exponent < 1 < square.at_the_end
        assert not square.met

    def test_objects_are_to_be_cheap_too(self) -> None:
        assert self.series("objects", 1e-3, 1e-3 + 9 * AN_OBJECT * 0.9).met
        assert not self.series("objects", 1e-3, 1e-3 + 9 * AN_OBJECT * 1.1).met
        assert self.series("lights", 1e-3, 1e-3 + 9 * AN_OBJECT * 1.1).met

    @pytest.mark.parametrize("what", SERIES)
    def test_scenes_hold_what_they_say(self, what: str, renderer: Renderer) -> None:
        make, steps = SERIES[what]
        assert list(steps) == sorted(steps)
        size, scene = make(steps[1])
        counted = {
            "triangles": sum(len(thing.mesh.triangles) for thing in scene.objects),  # type: ignore[union-attr]
            "lights": len(scene.lights),
            "pixels": scene.film.size[0] * scene.film.size[1],
            "objects": len(scene.objects),
        }
        assert counted[what] == size
        assert renderer.render(scene).pixels.max() > 100

    def test_objects_stand_apart_in_the_picture(self, renderer: Renderer) -> None:
        _, scene = SERIES["objects"][0](4)
        shown = renderer.render(scene).pixels.max(axis=2) > 0
        half = len(shown) // 2
        assert {
            bool(quarter.any()) for rows in (shown[:half], shown[half:]) for quarter in (rows[:, :half], rows[:, half:])
        } == {True}
        assert not shown[half].any()
        assert not shown[:, half].any()

    def test_a_small_series_is_measured(self) -> None:
        found = growth("pixels", repeat=2, small=True)
        assert found.sizes == (128**2, 256**2, 512**2)
        assert all(0 < spread.low <= spread.median <= spread.high for spread in found.seconds)


class TestReport:
    """What is printed and kept."""

    @pytest.fixture
    def report(self) -> Report:
        at = Spread(2.0, 1.0, 3.0)
        rows = [
            Row(GLSHADE, "driver", at, Spread(1.6, 1.5, 1.7), codes=0),
            Row(BY_HAND, "driver", Spread(4.0, 3.0, 5.0), at, Spread(0.5, 0.4, 0.6), target=0.4, codes=1),
            Row("vtk", fault="vtk ended early: oh"),
        ]
        jobs = Jobs.of(100, {1: [Took(2.0), Took(4.0)], 2: [Took(1.0), Took(2.0)]})
        return Report(2, False, {"W4": rows}, [TestGrowth.series("objects", 1e-3, 1e-3 + 1e-4)], jobs)

    def test_jobs_are_compared_in_frames_a_second_round_by_round(self) -> None:
        jobs = Jobs.of(100, {1: [Took(2.0), Took(4.0)], 2: [Took(1.0), Took(4.0)]})
        assert jobs.rates == {1: Spread(37.5, 25.0, 50.0), 2: Spread(62.5, 25.0, 100.0)}
        assert jobs.ratio == Spread(1.5, 1.0, 2.0)
        assert jobs.met

    def test_json(self, report: Report) -> None:
        found = json.loads(json.dumps(report.as_dict(), allow_nan=False))
        assert found["schema"] == SCHEMA
        assert found["machine"]["threads"] >= 1
        assert set(found["versions"]) == {GLSHADE, BY_HAND, "vtk"}
        ours, hand, vtk = found["works"]["W4"]["rows"]
        assert found["works"]["W4"]["limit_seconds"] == 1.5
        assert (ours["ratio"], ours["met"]) == (None, None)
        assert (hand["ratio"]["median"], hand["target"], hand["met"], hand["same_picture"]) == (0.5, 0.4, False, True)
        assert (vtk["seconds"], vtk["fault"]) == (None, "vtk ended early: oh")
        assert found["growth"][0]["seconds_each"] == pytest.approx(1e-4 / 9, rel=1e-3)
        assert found["jobs"]["ratio"]["median"] == 2.0

    def test_tables(self, report: Report) -> None:
        text = markdown(report)
        for line in (
            "| program | s | range | whole command | ratio | range | target | picture |",
            "| glshade | 2.00 | 1.00 to 3.00 | 1.60 s (<= 1.5 s: no) |  |  |  |  |",
            "| moderngl by hand | 4.00 | 3.00 to 5.00 | 2.00 s | 0.50 | 0.40 to 0.60 | <= 0.40: no | the same |",
            "| vtk | - | - | - | - | - | - | vtk ended early: oh |",
            "| objects | 1, 10 | 1 1.1 | 11.1 us | 0.04 | 0.04 | <= 1.15, <= 30 us each: yes |",
            "| 2 | 75.0 | 50.0 to 100 | 2.00 | 2.00 to 2.00 | >= 1.4: yes |",
        ):
            assert line in text.splitlines()


class TestCommand:
    """glshade bench."""

    def test_a_work_without_saying_work(self, glshade: Any) -> None:
        done = glshade("bench", "W1", "--size", "small", "--repeat", "1", "--peers", "moderngl", "--json")
        assert (done.returncode, done.stderr) == (0, "W1 ...\n")
        found = json.loads(done.stdout)
        assert (found["schema"], found["small"], found["repeat"]) == (SCHEMA, True, 1)
        assert [one["program"] for one in found["works"]["W1"]["rows"]] == [GLSHADE, BY_HAND]
        assert found["works"]["W1"]["rows"][1]["same_picture"] is True

    def test_markdown_and_a_copy_in_a_file(self, glshade: Any, tmp_path: Path) -> None:
        kept = tmp_path / "kept.json"
        done = glshade("bench", "growth", "--size", "small", "--repeat", "1", "--markdown", "--save", kept)
        assert done.returncode == 0, done.stderr
        found = json.loads(kept.read_text())
        assert [one["what"] for one in found["growth"]] == list(SERIES)
        assert f"- {found['machine']['cpu']}" in done.stdout
        for one in found["growth"]:
            assert f"| {one['what']} | {one['rows'][0]['size']:,}, {one['rows'][-1]['size']:,} |" in done.stdout

    @pytest.mark.slow
    @needs_pillow
    def test_batches(self, glshade: Any) -> None:
        done = glshade("bench", "W4", "jobs", "--size", "small", "--repeat", "1", "--peers", "moderngl", "--json")
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        assert found["works"]["W4"]["rows"][1]["same_picture"] is True
        assert [one["jobs"] for one in found["jobs"]["rows"]] == [1, 2]

    def test_wrong_names(self, glshade: Any) -> None:
        for arguments, said in (
            (("W9",), "no work is named 'W9'"),
            (("--peers", "moderngle"), "no installed peer is named 'moderngle'; did you mean \"moderngl\"?"),
            (("W1", "--json", "--markdown"), "--json or --markdown?"),
        ):
            done = glshade("bench", *arguments)
            assert done.returncode == 2
            assert said in done.stderr

    def test_help_names_what_there_is(self, glshade: Any) -> None:
        text = glshade("bench", "--help").stdout
        assert "brdfs" in text
        assert "work" in text
        assert all(name in glshade("bench", "work", "--help").stdout for name in (*WORKS, "growth", "jobs"))
