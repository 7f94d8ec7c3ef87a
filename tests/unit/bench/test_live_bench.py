"""The measurement of `glshade dev`. No test depends on the speed of the machine."""

from __future__ import annotations

from dataclasses import replace

import pytest

from glshade.bench.live import Edit, Latency, LiveFigures, Movement, measure_live

FAST = LiveFigures(
    "driver",
    (Edit(1, Latency(100, 200), {"watch": 20, "deliver": 5}), Edit(3, Latency(180, 300), {"watch": 20, "deliver": 6})),
    (Movement("orbit", 40, Latency(20, 50)), Movement("slider", 60, Latency(10, 20))),
    0.005,
)


def test_the_latency_of_times() -> None:
    assert Latency.of([1, 2, 3]) == Latency(2, pytest.approx(2.9))


def test_a_further_program() -> None:
    assert FAST.further == 40


@pytest.mark.parametrize(
    "change",
    [
        {"edits": (Edit(1, Latency(151, 200), {}), *FAST.edits[1:])},
        {"edits": (Edit(1, Latency(100, 221), {}), *FAST.edits[1:])},
        {"edits": (*FAST.edits[:1], Edit(3, Latency(221, 300), {}))},
        {"movements": (Movement("orbit", 29, Latency(20, 50)),)},
        {"movements": (Movement("orbit", 40, Latency(20, 61)),)},
        {"idle": 0.02},
    ],
)
def test_each_target_counts(change: dict[str, object]) -> None:
    assert FAST.met
    assert not replace(FAST, **change).met  # type: ignore[arg-type]


def test_without_proc_the_idle_share_does_not_count() -> None:
    figures = replace(FAST, idle=None)
    assert figures.met
    assert figures.as_dict()["idle_share"] is None


def test_the_table_has_a_row_for_each_measurement() -> None:
    heads, *rows = FAST.table()
    assert {len(row) for row in rows} == {len(heads)}
    assert [row[0] for row in rows] == ["edit of 1 program", "edit of 3 programs", "orbit", "slider", "idle"]
    assert rows[0][-1] == "watch 20, deliver 5"


@pytest.mark.slow
def test_a_measurement() -> None:
    figures = measure_live(1).as_dict()
    assert [edit["programs"] for edit in figures["edits"]] == [1, 2, 3]
    assert figures["edits"][0]["steps"].keys() >= {"watch", "read", "plan", "encode", "deliver"}
    assert [movement["name"] for movement in figures["movements"]] == ["orbit", "slider"]
