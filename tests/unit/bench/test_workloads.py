"""Works of `glshade bench`: their scenes, the programs and the report. No test depends on the speed of the machine."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import pytest

from glshade import Renderer, load
from glshade.bench import peers
from glshade.bench.contest import SAME, ContestRow, ContestTable, apart, in_turn, measure_work, row, run_contest, target
from glshade.bench.entrants import Cold, Files, RoundTimes, enter, pictures_took, read_codes, reports
from glshade.bench.growth import AN_OBJECT, SERIES, Growth, fitted, measure_growth
from glshade.bench.jobs import Jobs
from glshade.bench.process import Conversation, ProgramError, fault, timed
from glshade.bench.report import SCHEMA, BenchReport, markdown
from glshade.bench.stage import TURN, WorkFiles, eye, set_up, sphere
from glshade.bench.works import BY_HAND, DOOR, FASTEST, GLSHADE, WORKS
from glshade.driver.clock import Spread
from glshade.scene.file import SceneFile

SMALL = {name: work.small() for name, work in WORKS.items()}
needs_pillow = pytest.mark.skipif(
    importlib.util.find_spec("PIL") is None, reason="the peer moderngl writes PNG files by Pillow"
)


class TestStage:
    """The scene as arrays and as a file."""

    def test_shuffled_triangles_are_the_same_surface(self) -> None:
        (p, t), (q, u) = sphere(3), sphere(3, scattered=True)
        # The sum of its corners identifies a triangle, whichever corner comes first.
        assert sorted(map(tuple, p[t].sum(axis=1, dtype=float).round(5))) == sorted(
            map(tuple, q[u].sum(axis=1, dtype=float).round(5))
        )
        outward = np.einsum("ti,ti->t", np.cross(q[u[:, 1]] - q[u[:, 0]], q[u[:, 2]] - q[u[:, 0]]), q[u[:, 0]])
        assert (outward > 0).all()

        def step(positions: Any, triangles: Any) -> float:
            return float(np.linalg.norm(np.diff(positions[triangles].mean(axis=1), axis=0), axis=1).mean())

        assert step(q, u) > 5 * step(p, t)

    @pytest.mark.parametrize("name", WORKS)
    def test_the_scene_file_can_be_loaded(self, name: str, tmp_path: Path) -> None:
        stage = WorkFiles.load(str(set_up(SMALL[name], tmp_path)))
        scene = load(stage.scene)
        assert scene.film.size == (stage.side, stage.side)
        assert len(scene.lights) == {"directional": 2, "points": 9}[stage.lights]
        positions, triangles = stage.arrays()
        assert np.allclose(np.linalg.norm(positions, axis=1), 1, atol=1e-6)
        assert len(triangles) == 20 * 4 ** SMALL[name].subdivisions

    def test_the_animated_camera_equals_that_of_the_peers(self, tmp_path: Path) -> None:
        stage = WorkFiles.load(str(set_up(WORKS["W4"].small(), tmp_path)))
        for frame in (1, 2, 3):
            camera = SceneFile(Path(stage.scene)).scene(frame).camera
            angle = np.radians(camera.turn)
            assert np.allclose(eye(frame), (3 * np.sin(angle), 0, 3 * np.cos(angle)))
        assert np.allclose(eye(TURN + 1), eye(1))


class TestPrograms:
    """The programs that draw beside glshade."""

    def test_the_peer_by_hand_is_first_and_always_installed(self) -> None:
        assert peers.installed()[0] == BY_HAND
        assert set(peers.installed()) <= set(peers.NAMES)
        assert {"mitsuba", "moderngl", "panda3d", "pyrender", "vtk"} <= set(peers.NAMES)

    # W1 is slow here because test_work_is_the_default_subcommand draws it as well.
    @pytest.mark.parametrize("name", [pytest.param("W1", marks=pytest.mark.slow), "W2"])
    def test_the_peer_by_hand_draws_the_same_picture(self, name: str) -> None:
        ours, hand = measure_work(name, [BY_HAND], repeat=1, small=True).rows
        assert (ours.program, hand.program) == (GLSHADE, BY_HAND)
        assert ours.driver == hand.driver
        assert hand.codes is not None
        assert hand.codes <= SAME
        assert hand.target == WORKS[name].targets[BY_HAND]
        assert ours.seconds is not None
        assert hand.seconds is not None
        assert hand.ratio is not None
        # With a single round, the ratio is that of the times.
        assert hand.ratio.median == pytest.approx(ours.seconds.median / hand.seconds.median)

    @needs_pillow
    def test_files_are_the_frames_of_the_turntable(self, tmp_path: Path, renderer: Renderer) -> None:
        work = WORKS["W4"].small()
        stage = set_up(work, tmp_path)
        entrant = Files(BY_HAND, work, stage, tmp_path)
        timing = entrant.round()
        assert timing.whole is not None
        assert 0 < timing.seconds < timing.whole
        assert sorted(path.name for path in (tmp_path / "frames").iterdir()) == ["0001.png", "0002.png", "0003.png"]
        scenes = SceneFile(Path(WorkFiles.load(str(stage)).scene))
        assert apart(entrant.picture(), renderer.render(scenes.scene(work.frames)).pixels) <= SAME
        assert apart(entrant.picture(), renderer.render(scenes.scene(1)).pixels) > SAME

    @needs_pillow
    def test_a_cold_start_writes_the_picture(self, tmp_path: Path) -> None:
        stage = set_up(SMALL["W5"], tmp_path)
        pictures = []
        for name in (GLSHADE, BY_HAND):
            (tmp_path / name).mkdir()
            entrant = Cold(name, SMALL["W5"], stage, tmp_path / name)
            assert entrant.round().seconds > 0
            pictures.append(entrant.picture())
        assert apart(*pictures) <= SAME

    @pytest.mark.slow
    def test_every_installed_peer(self) -> None:
        rows = {result.program: result for result in measure_work("W1", peers.installed(), repeat=1, small=True).rows}
        assert set(rows) == {GLSHADE, *peers.installed()} - set(peers.VIEWERS)
        for name in {"moderngl", "panda3d", "vtk"} & set(rows):
            assert rows[name].same, rows[name]
        for name in {"mitsuba", "pyrender"} & set(rows):
            # Mitsuba needs LLVM, which the machine may lack.
            assert rows[name].codes is not None or rows[name].fault, rows[name]
            assert not rows[name].same

    def test_a_program_that_ends_early_is_reported_with_its_last_line(self, tmp_path: Path) -> None:
        stage = set_up(SMALL["W1"], tmp_path)
        with pytest.raises(ProgramError, match=r"nobody ended early: .*No module named 'glshade.bench.peers.nobody'"):
            enter("nobody", SMALL["W1"], stage, tmp_path)
        with pytest.raises(ProgramError, match="nobody ended early"):
            Cold("nobody", SMALL["W5"], stage, tmp_path).round()
        left_out = measure_work("W1", ["nobody"], repeat=1, small=True).rows[1]
        assert (left_out.program, left_out.seconds) == ("nobody", None)
        assert left_out.fault

    def test_the_time_that_a_command_reports(self) -> None:
        assert pictures_took([{"event": "begin"}, {"event": "end", "seconds": 3.0, "seconds_pictures": 2.5}]) == 2.5
        with pytest.raises(ProgramError, match="did not say"):
            pictures_took([{"event": "end", "seconds": 3.0}])
        assert reports('{"event": "begin"}\n') == [{"event": "begin"}]
        with pytest.raises(ProgramError, match="not JSON"):
            reports("Segmentation fault\n")

    def test_a_file_that_is_no_picture_is_an_error(self, tmp_path: Path) -> None:
        (tmp_path / "x.png").write_bytes(b"not a picture")
        with pytest.raises(ProgramError, match="not a picture"):
            read_codes(tmp_path / "x.png")


PYTHON = [sys.executable, "-c"]


class TestProcess:
    """Processes that fail, crash, or hang."""

    def test_a_command_is_timed_and_its_memory_is_that_of_its_largest_process(self) -> None:
        child = [*PYTHON, "x = b'x' * 300_000_000"]
        run = timed([*PYTHON, f"import subprocess; subprocess.run({child})"], "it")
        assert run.seconds > 0
        assert 300e6 < run.peak < 400e6
        # This process has more memory than the command, whose peak is its own nevertheless.
        assert timed([*PYTHON, "print('done')"], "it").peak < 50e6

    def test_a_crash_is_told_by_its_signal_and_last_words(self) -> None:
        crash = "import os, sys; print('LLVM ERROR: Cannot select', file=sys.stderr, flush=True); os.abort()"
        with pytest.raises(ProgramError, match=r"it ended early by SIGABRT: LLVM ERROR: Cannot select; .*Debian: libllvm19"):
            timed([*PYTHON, crash], "it")
        with pytest.raises(ProgramError, match=r"it ended early by SIGABRT: LLVM ERROR"):
            Conversation("it", [*PYTHON, crash])
        with pytest.raises(ProgramError, match=r"it ended early by SIGSEGV: it printed nothing"):
            timed([*PYTHON, "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"], "it")
        assert fault("it", "a\nb\n", -200) == "it ended early by signal 200: b"

    def test_a_process_may_crash_between_two_answers(self) -> None:
        talk = Conversation(
            "it", [*PYTHON, "print(1, flush=True); input(); print(2, flush=True); input(); raise OSError('oh')"]
        )
        assert (talk.first, talk.ask("x")) == (1, 2)
        with pytest.raises(ProgramError, match="it ended early: OSError: oh"):
            talk.ask("y")
        talk.close()

    def test_a_program_that_hangs_is_ended(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("glshade.bench.process.PATIENCE", 0.3)
        for start in (lambda: timed(["sleep", "60"], "it"), lambda: Conversation("it", ["sleep", "60"])):
            before = monotonic()
            with pytest.raises(ProgramError, match=r"it took longer than 0\.3 s and was ended"):
                start()
            assert monotonic() - before < 30

    def test_what_is_not_there_or_not_json_is_an_error(self) -> None:
        for start in (lambda: timed(["/no/such/program"], "it"), lambda: Conversation("it", ["/no/such/program"])):
            with pytest.raises(ProgramError, match=r"it .*No such file"):
                start()
        with pytest.raises(ProgramError, match="not JSON"):
            Conversation("it", ["echo", "hello"])


class Fake:
    """An entrant with given times. An exception among them is raised in its round."""

    driver = None

    def __init__(self, name: str, log: list[str], *times: float | Exception) -> None:
        self._name, self._log, self._times = name, log, iter(times)

    def round(self) -> RoundTimes:
        self._log.append(self._name)
        time = next(self._times)
        if isinstance(time, Exception):
            raise time
        return RoundTimes(time)

    def picture(self) -> Any:
        return np.zeros((1, 1, 3), dtype=np.uint8)

    def close(self) -> None:
        pass


class TestRounds:
    """Rounds of several programs, and the ratios and targets of their times."""

    def test_the_first_round_is_not_counted_and_each_round_begins_with_another_program(self) -> None:
        log: list[str] = []
        entrants = {GLSHADE: Fake(GLSHADE, log, 99, 1, 2), "b": Fake("b", log, 98, 3, 4)}
        timings = in_turn(entrants, 2, {})
        assert timings == {GLSHADE: [RoundTimes(1), RoundTimes(2)], "b": [RoundTimes(3), RoundTimes(4)]}
        assert log == [GLSHADE, "b", "b", GLSHADE, GLSHADE, "b"]

    def test_a_failed_program_drops_out_unless_it_is_glshade(self) -> None:
        log: list[str] = []
        faults: dict[str, str] = {}
        broken = Fake("b", log, 1, ProgramError("b ended early: oh"))
        assert in_turn({GLSHADE: Fake(GLSHADE, log, 9, 1, 2), "b": broken}, 2, faults) == {
            GLSHADE: [RoundTimes(1), RoundTimes(2)]
        }
        assert faults == {"b": "b ended early: oh"}
        with pytest.raises(ProgramError):
            in_turn({GLSHADE: Fake(GLSHADE, log, ProgramError("no"))}, 1, {})
        alone = run_contest({}, ["b"], lambda name, folder: Fake(name, log, 1, ProgramError("no")), 1)
        assert [(result.program, result.fault) for result in alone] == [(GLSHADE, "no")]

    def test_a_program_without_a_picture_is_a_fault_of_that_program(self) -> None:
        class Blind(Fake):
            def picture(self) -> Any:
                raise FileNotFoundError("no picture")

        kinds = {GLSHADE: Fake, "b": Blind}
        rows = run_contest({}, ["b"], lambda name, folder: kinds[name](name, [], 1, 1), 1)
        assert [(result.program, result.fault) for result in rows] == [(GLSHADE, None), ("b", "no picture")]

    def test_ratios_are_of_the_same_round(self) -> None:
        timings = {
            GLSHADE: [RoundTimes(1.0), RoundTimes(4.0), RoundTimes(2.0)],
            "b": [RoundTimes(2.0), RoundTimes(4.0), RoundTimes(8.0)],
        }
        none: dict[str, Any] = {GLSHADE: None, "b": None}
        assert row("b", timings, None, none).ratio == Spread(0.5, 0.25, 1.0)
        assert row(GLSHADE, timings, None, none).ratio is None
        assert row("b", timings, None, none).whole is None
        assert row("b", timings, None, none).codes is None
        whole = {GLSHADE: [RoundTimes(1.0, 3.0)], "b": [RoundTimes(2.0, 5.0, 70), RoundTimes(2.0, 5.0, 80)][:1]}
        assert row("b", whole, None, none).whole == Spread(5.0, 5.0, 5.0)
        assert row("b", whole, None, none).peak == 70

    def test_pyrender_is_compared_with_the_replacement_of_its_renderer(self) -> None:
        timings = {GLSHADE: [RoundTimes(1.0)], DOOR: [RoundTimes(3.0)], "pyrender": [RoundTimes(6.0)], "b": [RoundTimes(2.0)]}
        pictures: dict[str, Any] = {name: np.full((1, 1, 3), code, np.uint8) for code, name in enumerate(timings)}
        result = row("pyrender", timings, None, pictures)
        assert (result.ratio, result.beside, result.codes) == (Spread(0.5, 0.5, 0.5), DOOR, 1)
        assert row("b", timings, None, pictures).beside == GLSHADE
        assert row(DOOR, timings, None, pictures).ratio is None
        without = {name: times for name, times in timings.items() if name != DOOR}
        assert row("pyrender", without, None, {name: pictures[name] for name in without}).beside == GLSHADE

    def test_the_strictest_target_applies(self) -> None:
        def done(name: str, seconds: float, codes: int = 0) -> ContestRow:
            return ContestRow(name, seconds=Spread(seconds, seconds, seconds), codes=codes)

        rows = [done(GLSHADE, 1), done("b", 2), done("c", 3), done("d", 4, codes=9)]
        targets = {"c": 0.5, "d": 0.3, FASTEST: 0.4}
        assert [target(targets, result, rows) for result in rows] == [None, 0.4, 0.5, 0.3]
        targets = {"c": 0.5, "peers": 1.0}
        assert [target(targets, result, rows) for result in rows] == [None, 1.0, 0.5, None]

    def test_a_target_is_met_or_not(self) -> None:
        ratio = Spread(0.5, 0.1, 0.9)
        assert ContestRow("b", ratio=ratio, target=0.5).met is True
        assert ContestRow("b", ratio=ratio, target=0.49).met is False
        assert ContestRow("b", ratio=ratio).met is None

    def test_pictures_are_the_same_to_one_code(self) -> None:
        a = np.array([[[0, 255, 3]]], dtype=np.uint8)
        assert apart(a, a) == 0
        assert apart(a, np.array([[[1, 254, 3]]], dtype=np.uint8)) == 1
        assert apart(a, np.array([[[255, 255, 3]]], dtype=np.uint8)) == 255
        assert apart(a, a[:, :0]) == 255
        assert [ContestRow("b", codes=codes).same for codes in (None, 0, 1, 2)] == [False, True, True, False]


class TestGrowth:
    """Growth of the time of a frame, as exponents."""

    def test_the_exponent_is_that_of_the_power_law(self) -> None:
        sizes = [1, 10, 100, 1000]
        for exponent in (0.0, 0.5, 1.0, 2.0):
            assert fitted(sizes, [3.0 * size**exponent for size in sizes]) == pytest.approx(exponent)

    @staticmethod
    def series(what: str, *seconds: float) -> Growth:
        return Growth(what, tuple(10**i for i in range(len(seconds))), tuple(Spread(s, s, s) for s in seconds))

    def test_a_fixed_cost_does_not_hide_growth_at_the_end(self) -> None:
        linear = self.series("lights", *(1 + 1e-3 * 10**i for i in range(5)))
        assert linear.each == pytest.approx(1e-3)
        assert linear.met
        square = self.series("lights", *(1 + 1e-6 * 100**i for i in range(5)))
        assert square.exponent < 1 < square.at_the_end
        assert not square.met

    def test_objects_have_a_target_for_each_one(self) -> None:
        assert self.series("objects", 1e-3, 1e-3 + 9 * AN_OBJECT * 0.9).met
        assert not self.series("objects", 1e-3, 1e-3 + 9 * AN_OBJECT * 1.1).met
        assert self.series("lights", 1e-3, 1e-3 + 9 * AN_OBJECT * 1.1).met

    @pytest.mark.parametrize("what", SERIES)
    def test_scenes_have_the_stated_size(self, what: str, renderer: Renderer) -> None:
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
        covered = renderer.render(scene).pixels.max(axis=2) > 0
        half = len(covered) // 2
        quarters = [quarter for rows in (covered[:half], covered[half:]) for quarter in (rows[:, :half], rows[:, half:])]
        assert all(quarter.any() for quarter in quarters)
        assert not covered[half].any()
        assert not covered[:, half].any()

    def test_a_small_series_is_measured(self) -> None:
        growth = measure_growth("pixels", repeat=2, small=True)
        assert growth.sizes == (128**2, 256**2, 512**2)
        assert all(0 < spread.low <= spread.median <= spread.high for spread in growth.seconds)


class TestReport:
    """The report as JSON and as tables."""

    @pytest.fixture
    def report(self) -> BenchReport:
        two = Spread(2.0, 1.0, 3.0)
        rows = [
            ContestRow(GLSHADE, "driver", two, Spread(1.6, 1.5, 1.7), codes=0, peak=120_000_000),
            ContestRow(BY_HAND, "driver", Spread(4.0, 3.0, 5.0), two, Spread(0.5, 0.4, 0.6), target=0.4, codes=1),
            ContestRow("vtk", fault="vtk ended early: oh"),
        ]
        jobs = Jobs.of(100, {1: [RoundTimes(2.0), RoundTimes(4.0)], 2: [RoundTimes(1.0), RoundTimes(2.0)]})
        table = ContestTable("frames", rows, "s", limit=1.5, memory=110_000_000)
        return BenchReport(2, False, {"W4": table}, [TestGrowth.series("objects", 1e-3, 1e-3 + 1e-4)], jobs)

    def test_jobs_are_compared_in_frames_a_second_round_by_round(self) -> None:
        jobs = Jobs.of(100, {1: [RoundTimes(2.0), RoundTimes(4.0)], 2: [RoundTimes(1.0), RoundTimes(4.0)]})
        assert jobs.rates == {1: Spread(37.5, 25.0, 50.0), 2: Spread(62.5, 25.0, 100.0)}
        assert jobs.ratio == Spread(1.5, 1.0, 2.0)
        assert jobs.met

    def test_json(self, report: BenchReport) -> None:
        result = json.loads(json.dumps(report.as_dict(), allow_nan=False))
        assert result["schema"] == SCHEMA
        assert result["machine"]["threads"] >= 1
        assert set(result["versions"]) == {GLSHADE, BY_HAND, "vtk"}
        ours, hand, vtk = result["works"]["W4"]["rows"]
        assert result["works"]["W4"]["limit_seconds"] == 1.5
        assert (ours["ratio"], ours["met"]) == (None, None)
        assert (hand["ratio"]["median"], hand["target"], hand["met"], hand["same_picture"]) == (0.5, 0.4, False, True)
        assert (vtk["seconds"], vtk["fault"]) == (None, "vtk ended early: oh")
        assert result["growth"][0]["seconds_each"] == pytest.approx(1e-4 / 9, rel=1e-3)
        assert result["jobs"]["ratio"]["median"] == 2.0

    def test_tables(self, report: BenchReport) -> None:
        text = markdown(report)
        for line in (
            "### W4: frames",
            "| program | s | range | whole command | ratio | range | target | MB | picture |",
            "| glshade | 2.00 | 1.00 to 3.00 | 1.60 s |  |  | <= 1.5 s: no | 120 (<= 110: no) |  |",
            "| moderngl by hand | 4.00 | 3.00 to 5.00 | 2.00 s | 0.50 | 0.40 to 0.60 | <= 0.40: no |  | the same |",
            "| vtk | - | - | - | - | - | - | - | vtk ended early: oh |",
            "| objects | 1, 10 | 1 1.1 | 11.1 us | 0.04 | 0.04 | <= 1.1, <= 30 us each: yes |",
            "| 2 | 75.0 | 50.0 to 100 | 2.00 | 2.00 to 2.00 | >= 1.4: yes |",
        ):
            assert line in text.splitlines()


class TestCommand:
    """glshade bench."""

    def test_work_is_the_default_subcommand(self, glshade: Any) -> None:
        done = glshade("bench", "W1", "--size", "small", "--repeat", "1", "--peers", "moderngl", "--json")
        assert (done.returncode, done.stderr) == (0, "W1 ...\n")
        result = json.loads(done.stdout)
        assert (result["schema"], result["small"], result["repeat"]) == (SCHEMA, True, 1)
        assert [row["program"] for row in result["works"]["W1"]["rows"]] == [GLSHADE, BY_HAND]
        assert result["works"]["W1"]["rows"][1]["same_picture"] is True

    @pytest.mark.slow
    def test_markdown_and_a_copy_in_a_file(self, glshade: Any, tmp_path: Path) -> None:
        kept = tmp_path / "kept.json"
        done = glshade("bench", "growth", "--size", "small", "--repeat", "1", "--markdown", "--save", kept)
        assert done.returncode == 0, done.stderr
        result = json.loads(kept.read_text())
        assert [growth["what"] for growth in result["growth"]] == list(SERIES)
        assert f"- {result['machine']['cpu']}" in done.stdout
        for growth in result["growth"]:
            sizes = f"{growth['rows'][0]['size']:,}, {growth['rows'][-1]['size']:,}"
            assert f"| {growth['what']} | {sizes} |" in done.stdout

    @pytest.mark.slow
    @needs_pillow
    def test_batches(self, glshade: Any) -> None:
        done = glshade("bench", "W4", "jobs", "--size", "small", "--repeat", "1", "--peers", "moderngl", "--json")
        assert done.returncode == 0, done.stderr
        result = json.loads(done.stdout)
        assert result["works"]["W4"]["rows"][1]["same_picture"] is True
        assert [row["jobs"] for row in result["jobs"]["rows"]] == [1, 2]

    def test_unknown_names(self, glshade: Any) -> None:
        for arguments, message in (
            (("W9",), "no work is named 'W9'"),
            (("--peers", "moderngle"), "no installed peer is named 'moderngle'; did you mean \"moderngl\"?"),
            (("W1", "--json", "--markdown"), "--json and --markdown exclude each other"),
        ):
            done = glshade("bench", *arguments)
            assert done.returncode == 2
            assert message in done.stderr

    def test_help_names_all_works(self, glshade: Any) -> None:
        text = glshade("bench", "--help").stdout
        assert "brdfs" in text
        assert "work" in text
        assert all(name in glshade("bench", "work", "--help").stdout for name in (*WORKS, "growth", "jobs"))
