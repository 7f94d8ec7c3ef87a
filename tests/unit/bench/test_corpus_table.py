"""The table of `glshade bench compare`: shares, thresholds in hindsight, and the judges beside glshade."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from glshade.bench.corpus.case import write_pixels
from glshade.bench.corpus.judges import JUDGES, Judgement, Pair, by_value
from glshade.bench.corpus.judging import available
from glshade.bench.corpus.making import Item
from glshade.bench.corpus.speed import Speed, Timing
from glshade.bench.corpus.table import HEADS, Judged, Tally, best_threshold, listed
from glshade.cli.bench import command

PAIRS = Path(__file__).resolve().parents[4] / "shared" / "data" / "pairs" / "pixelmatch"
# The numbers of different pixels that pixelmatch's own tests expected for its pairs 1 to 4, with the threshold 0.05, up to
# version 7. Version 8 measures colours otherwise; the Python port measures like version 7.
OWN_COUNTS = {"1": 143, "2": 12437, "3": 212, "4": 36049}


def regression(kind: str, far: int, **judgements: Judgement) -> Judged:
    return Judged(Item("rates", "regressions", kind, 1), far, 0.5, judgements)


def noise(kind: str, moved: float = 0.03, **judgements: Judgement) -> Judged:
    return Judged(Item("rates", "noises", kind), 50, moved, judgements)


YES, NO = Judgement(True), Judgement(False)
TALLY = Tally(
    [
        regression("blurred", 500, idiff=YES, flip=Judgement(False, 0.2)),
        regression("blurred", 400, idiff=NO, flip=Judgement(False, 0.05)),
        regression("exposed", 300, idiff=YES, flip=Judgement(False, 0.01)),
        regression("faint", 9, idiff=YES, flip=Judgement(False, 0.001)),
        regression("broken", 10, idiff=YES, flip=Judgement(True)),
        noise("jitter", idiff=YES, flip=Judgement(False, 0.02)),
        noise("threads", idiff=NO, flip=Judgement(False, 0.0)),
        noise("centroids", moved=0.031, idiff=YES, flip=Judgement(False, 0.3)),
    ]
)


class TestTally:
    """What is counted."""

    def test_the_counts_of_a_judge_with_a_threshold(self) -> None:
        row = TALLY.row("idiff")
        assert (row.found, row.regressions, row.alarms, row.noises, row.weak_found, row.weak) == (3, 4, 1, 2, 1, 1)
        assert (row.variants_rejected, row.variants) == (1, 1)
        assert (row.missed, row.alarming) == ({"blurred": 1}, {"jitter": 1})

    def test_a_judge_without_a_threshold_gets_the_best_one(self) -> None:
        row = TALLY.row("flip")
        # The threshold is 0.02, the largest value of a noise; a value that is not finite is flagged in any case.
        assert (row.found, row.alarms, row.missed) == (3, 0, {"exposed": 1})
        assert "0.0200" in row.title

    def test_the_cells_fit_the_heads(self) -> None:
        cells = TALLY.row("idiff").cells()
        assert len(cells) == len(HEADS)
        assert cells[1:] == ["75.0 % (3 of 4)", "50.0 % (1 of 2)", "100.0 % (1 of 1)", "100.0 % (1 of 1)"]

    def test_what_is_listed_apart_is_never_wrong(self) -> None:
        assert [pair.item.kind for pair, _ in TALLY.wrong("idiff")] == ["blurred", "jitter"]

    def test_the_tally_is_json(self) -> None:
        data = json.loads(json.dumps(TALLY.as_dict(), allow_nan=False))
        assert [pair["counts_as"] for pair in data["pairs"]].count("weak") == 1
        assert data["judges"]["idiff"]["missed"] == {"blurred": 1}

    def test_nothing_judged_is_no_division_by_zero(self) -> None:
        assert Tally().rows() == []
        only = Tally([noise("jitter", idiff=NO)])
        assert only.row("idiff").cells()[1] == "-"

    @given(st.lists(st.floats(0, 1), min_size=1, max_size=400), st.floats(0, 0.2))
    def test_a_threshold_in_hindsight_is_the_smallest_that_allows_the_share(self, values: list[float], share: float) -> None:
        threshold = best_threshold(values, share)
        assert threshold is not None
        assert sum(value > threshold for value in values) <= share * len(values)
        for smaller in (value for value in values if value < threshold):
            assert sum(value > smaller for value in values) > share * len(values)

    def test_long_lists_are_cut(self) -> None:
        assert listed({}) == "none"
        assert listed({"a": 2, "b": 1}) == "a 2, b 1"
        assert listed({str(k): 1 for k in range(20)}, most=2) == "0 1, 1 1, ..."


class TestJudges:
    """The judges, on pairs whose differences are known."""

    @pytest.fixture
    def pair(self, tmp_path: Path) -> Any:
        """`pair(change, floats)` is a pair of a grey picture and the same picture after a change of its pixels."""

        def made(change: Any, floats: bool = False) -> Pair:
            pixels = np.full((20, 20, 3), 0.25 if floats else 120, dtype=np.float32 if floats else np.uint8)
            paths = [tmp_path / f"{name}.{'exr' if floats else 'png'}" for name in ("reference", "test")]
            for path, values in zip(paths, (pixels, change(pixels.copy())), strict=True):
                write_pixels(path, values, {})
            return Pair(tmp_path / "scene.json", *paths)

        return made

    @pytest.fixture(params=sorted(set(JUDGES) - {"scene"}))
    def judge(self, request: pytest.FixtureRequest) -> Any:
        found = available([request.param], lambda text: None)
        return found[request.param] if found else pytest.skip(f"{request.param} is not installed")

    @pytest.mark.parametrize("floats", [False, True])
    def test_no_judge_flags_equal_pictures(self, judge: Any, pair: Any, floats: bool) -> None:
        judgement = judge.judge(pair(lambda pixels: pixels, floats))
        assert not judgement.flagged
        assert not judgement.value

    @pytest.mark.parametrize("floats", [False, True])
    def test_every_judge_sees_black_and_white(self, judge: Any, pair: Any, floats: bool) -> None:
        judgement = judge.judge(pair(lambda pixels: pixels * 0, floats))
        assert judgement.flagged or (judge.threshold is None and judgement.value > 0.1)

    def test_the_root_mean_square_is_in_codes(self, pair: Any) -> None:
        assert JUDGES["rms"]().judge(pair(lambda pixels: pixels + np.uint8(3))).value == pytest.approx(3)

    def test_idiff_counts_pixels(self, pair: Any) -> None:
        def one(pixels: Any) -> Any:
            pixels[3, 4] = 255
            return pixels

        assert JUDGES["idiff"]().judge(pair(one)) == Judgement(True, 0.25, "1 pixels, at most 0.529412")
        assert not JUDGES["idiff_loose"]().judge(pair(one)).flagged

    def test_glshade_without_a_scene_lets_codes_differ_by_one(self, pair: Any) -> None:
        assert not JUDGES["codes"]().judge(pair(lambda pixels: pixels + np.uint8(1))).flagged
        assert JUDGES["codes"]().judge(pair(lambda pixels: pixels + np.uint8(2))).flagged

    def test_a_number_that_is_not_finite_is_flagged(self) -> None:
        assert by_value(float("nan"), 1.0) == Judgement(True)

    # The pairs 2 and 4 differ in most of their pixels, with which the library takes a second.
    @pytest.mark.parametrize("number", ["1", "3", *(pytest.param(number, marks=pytest.mark.slow) for number in "24")])
    def test_pixelmatch_counts_as_its_own_tests_do(self, number: str) -> None:
        pytest.importorskip("pixelmatch")
        files = [PAIRS / f"{number}{side}.png" for side in "ab"]
        if not files[0].exists():
            pytest.skip("../shared/data/pairs/pixelmatch is absent")
        judge: Any = JUDGES["pixelmatch"]()
        assert judge.count(*Pair(files[0], *files).codes, threshold=0.05) == OWN_COUNTS[number]

    def test_a_judge_that_is_not_installed_is_left_out(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(__import__("sys").modules, "pixelmatch", None)
        lines: list[str] = []
        assert list(available(["rms", "pixelmatch"], lines.append)) == ["rms"]
        assert "pip install 'glshade[peers]'" in lines[0]


class TestSpeed:
    """The table of times."""

    def test_the_table_names_the_share_of_the_target(self) -> None:
        speed = Speed("driver", (Timing("pairs", 3.0, 6.0, 100.0, 0),))
        heads, rows = speed.table()
        assert len(heads) == len(rows[0])
        assert rows[0] == ["pairs", "3.00", "6", "0.50", "100", "0"]
        assert json.loads(json.dumps(speed.as_dict()))["timings"][0]["seconds"] == 3.0


class TestCommand:
    """`glshade bench compare`."""

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            ([], "either --corpus FOLDER or --speed"),
            (["--corpus", "c", "--speed"], "either --corpus FOLDER or --speed"),
            (["--corpus", "c", "--json", "--markdown"], "exclude each other"),
            (["--corpus", "c", "--judge", "idif"], "idiff"),
            (["--corpus", "c", "--count", "0"], "--count"),
            (["--speed", "--judge", "idiff"], "--judge"),
        ],
    )
    def test_wrong_usage_says_what_is_right(
        self, arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        result = CliRunner().invoke(command, ["compare", *arguments])
        assert not Path("c").exists()
        assert result.exit_code == 2
        assert words in result.output

    def test_a_part_of_the_corpus(self, tmp_path: Path) -> None:
        arguments = [
            "compare",
            "--corpus",
            str(tmp_path / "c"),
            "--count",
            "4",
            "--seed",
            "5",
            "--judge",
            "rms",
            "--judge",
            "idiff",
        ]
        result = CliRunner().invoke(command, [*arguments, "--json"])
        data = json.loads(result.stdout)
        assert list(data["judges"]) == ["rms", "idiff"]
        assert len(data["pairs"]) + data["inapplicable"] == 4
        again = CliRunner().invoke(command, [*arguments, "--markdown"])
        assert again.stdout.startswith("| judge | regressions found |")


@pytest.mark.slow
def test_speed_is_measured() -> None:
    from glshade.bench.corpus.speed import measure_speed

    timings = measure_speed(2).timings
    assert len(timings) == 6
    assert all(timing.seconds > 0 and timing.megabytes > 10 for timing in timings)
    # Codes differ by one, so the pairs are the same; the last picture is far too dark.
    assert [timing.code for timing in timings] == [0, 0, 0, 0, 0, 2]
