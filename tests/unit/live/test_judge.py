"""The judge: verdicts, probes and references of the very views that pages show."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.drawn import FROM_ABOVE, SCENE, Drawn, drawn, pixels_of
from support.texts import needs_compiler

from glshade import load, reference
from glshade.live.judge import Judge
from glshade.live.messages import (
    Answer,
    Failed,
    Frame,
    Heat,
    Judged,
    Loaded,
    LostDigits,
    MeasureDigits,
    Probe,
    Probed,
    Reference,
    Restore,
    ShowVariable,
    Trace,
    Traced,
    Verify,
)
from glshade.spirv.compiler import _binary

# A model in GLSL alone. Its line 9 rounds to a step of 2^-10, and line 10 shows how few digits are left.
GLEAM = """#include "surface/frame.glsl"
// A test.
struct Gleam {
    vec3 kd;  // [0, 1] default [0.5, 0.5, 0.5]: colour
};

vec3 brdf_cos(Gleam m, Frame f, vec3 l, vec3 v) {
    float NoL = max(dot(f.n, l), 0.0);
    float far = NoL + 8192.0;
    float back = far - 8192.0;
    return m.kd * back;
}
"""


class Court:
    """A drawer, and a judge of what it shows."""

    def __init__(self, live: Drawn) -> None:
        self.live, self.judge = live, Judge("auto", "", "")

    def restore(self) -> Loaded:
        """Returns the judge's answer after it has taken over what the drawer shows."""
        loaded = self.live.load()
        assert loaded.ok, loaded.problems
        assert loaded.snapshot is not None
        answer = self.ask(Restore(folder=loaded.snapshot))
        assert isinstance(answer, Loaded)
        return answer

    def ask(self, request: Any) -> Answer:
        return self.judge.answer(request)

    def verdict(self, **view: Any) -> Judged:
        answer = self.ask(Verify(view=view))
        assert isinstance(answer, Judged), answer
        return answer


@pytest.fixture
def court(tmp_path: Path) -> Iterator[Court]:
    with drawn(tmp_path) as live:
        court = Court(live)
        yield court
        if court.judge._opened is not None:
            court.judge._opened.release()


def test_a_right_picture_is_verified_from_every_camera(court: Court) -> None:
    assert court.restore().shown == 1
    for view in ({}, FROM_ABOVE, {"camera": {"name": "side"}}, {"shading": "flat"}, {"set": {"lights.sun.intensity": 0.4}}):
        verdict = court.verdict(**view)
        assert (verdict.verdict, verdict.unexplained, verdict.pixels) == ("verified", 0, []), verdict.text
        assert (verdict.revision, verdict.derived) == (1, False)


def test_a_changed_shader_is_not_verified_and_its_pixels_are_listed(court: Court) -> None:
    court.live.write("phong", court.live.shipped("phong").replace("return ", "return 1.02 * ", 1))
    court.restore()
    verdict = court.verdict()
    assert verdict.verdict == "failed"
    assert verdict.unexplained > 0
    assert len(verdict.pixels) == min(verdict.unexplained, 200)
    assert all(x < 24 for x, _ in verdict.pixels), "only the left sphere has this model"


def test_a_probe_tells_value_reference_and_interval(court: Court) -> None:
    court.restore()
    probed = court.ask(Probe(view={}, x=12, y=14))
    assert isinstance(probed, Probed)
    assert (probed.object, probed.kind) == ("one", "interior")
    assert probed.triangle is not None
    expected = reference.render(load(court.live.scene)).pixels[14, 12]
    assert probed.reference == pytest.approx(expected, rel=1e-5)
    for low, value, high in zip(probed.low, probed.value, probed.high, strict=True):
        assert low <= value <= high
    assert "explained" in probed.text
    background = court.ask(Probe(view={}, x=0, y=0))
    assert isinstance(background, Probed)
    assert (background.object, background.triangle, background.kind) == (None, None, "background")
    assert isinstance(court.ask(Probe(view={}, x=48, y=0)), Failed)


def test_the_reference_and_the_heat_map_are_pictures(court: Court) -> None:
    court.restore()
    drawn_pixels = court.live.pixels(**FROM_ABOVE).astype(int)
    answer = court.ask(Reference(view=FROM_ABOVE))
    assert isinstance(answer, Frame)
    difference = np.abs(pixels_of(answer).astype(int) - drawn_pixels)
    assert np.quantile(difference, 0.98) <= 1
    heat = court.ask(Heat(view=FROM_ABOVE))
    assert isinstance(heat, Frame)
    assert heat.scale is not None
    assert heat.scale["low"] < heat.scale["high"]
    assert all(len(colour) == 7 for colour in heat.scale["colours"])
    assert pixels_of(heat).shape == (32, 48, 3)


@pytest.fixture
def gleam(court: Court) -> Court:
    """A judge of a picture whose right sphere has a model in GLSL alone."""
    court.live.write("gleam", GLEAM)
    court.live.scene.write_text(SCENE.replace('brdf = "lambert"', 'brdf = "gleam"'))
    court.restore()
    return court


@needs_compiler
def test_a_model_without_a_reference_is_verified_against_its_own_text(gleam: Court) -> None:
    verdict = gleam.verdict()
    assert (verdict.verdict, verdict.derived, verdict.unexplained) == ("verified", True, 0), verdict.text
    assert verdict.text.startswith("verified against its own text: ")
    answer = gleam.ask(Reference(view={}))
    assert isinstance(answer, Frame)
    difference = np.abs(pixels_of(answer).astype(int) - gleam.live.pixels().astype(int))
    assert np.quantile(difference, 0.98) <= 1


def test_without_a_compiler_a_model_without_a_reference_has_no_verdict(gleam: Court, monkeypatch: pytest.MonkeyPatch) -> None:
    _binary.cache_clear()
    monkeypatch.setenv("PATH", "")
    verdict = gleam.verdict()
    assert (verdict.verdict, verdict.derived) == ("none", False)
    assert "has only its GLSL" in verdict.text
    assert "apt install glslang-tools" in verdict.text
    assert "\n" not in verdict.text


@needs_compiler
def test_the_variables_of_a_pixel_are_listed_as_they_ran(gleam: Court) -> None:
    answer = gleam.ask(Trace(view={}, x=34, y=14))
    assert isinstance(answer, Traced)
    assert (answer.object, answer.revision, answer.left_out) == (1, 1, 0)
    own = [step for step in answer.steps if step["short"] == "brdf/gleam.glsl"]
    assert [(step["line"], step["name"]) for step in own] == [(8, "NoL"), (9, "far"), (10, "back"), (11, "return")]
    n, _, back, _ = own
    assert n["text"] == "float NoL = max(dot(f.n, l), 0.0);"
    assert float(back["float64"]) == pytest.approx(float(n["float64"]), abs=1e-8)
    assert n["digits"] < 1 < 2 < back["digits"] < 7
    assert back["float32"] != back["float64"]
    background = gleam.ask(Trace(view={}, x=0, y=0))
    assert isinstance(background, Traced)
    assert (background.object, background.steps) == (None, [])
    assert isinstance(gleam.ask(Trace(view={}, x=48, y=0)), Failed)


@needs_compiler
def test_a_variable_is_a_picture_of_the_object_that_has_it(gleam: Court) -> None:
    traced = gleam.ask(Trace(view={}, x=34, y=14))
    assert isinstance(traced, Traced)
    step = next(step for step in traced.steps if step["name"] == "NoL")
    variable = {"object": 1, "place": f"{step['file']}:{step['line']}", "name": "NoL", "number": 0}
    frame = gleam.ask(ShowVariable(view={"source": "variable", "variable": variable}))
    assert isinstance(frame, Frame)
    assert frame.scale is not None
    assert 0 <= frame.scale["low"] < float(step["float64"]) < frame.scale["high"] <= 1
    pixels = pixels_of(frame)
    assert pixels.shape == (32, 48, 4)
    assert pixels[14, 34, 3] == 255
    assert not pixels[:, :24, 3].any(), "the left sphere has another program"
    light, dark = pixels[14, 34, :3].astype(int), pixels[20, 42, :3].astype(int)
    assert light.sum() > dark.sum()
    missing = gleam.ask(ShowVariable(view={"source": "variable", "variable": {**variable, "object": 0}}))
    assert isinstance(missing, Failed)
    assert "no visible program gives NoL" in missing.problems[0]["message"]
    assert isinstance(gleam.ask(ShowVariable(view={})), Failed)


@needs_compiler
def test_lines_that_lose_digits_are_found(gleam: Court) -> None:
    answer = gleam.ask(MeasureDigits(view={}, object=1))
    assert isinstance(answer, LostDigits)
    found = {(line["file"].rpartition("/")[2], line["line"]): line for line in answer.lines}
    assert set(found) == {("gleam.glsl", 9)}, "the sum rounds; the difference is exact"
    (line,) = found.values()
    assert (line["text"], line["ill_posed"]) == ("float far = NoL + 8192.0;", False)
    assert line["digits"] > 3
    left = gleam.ask(MeasureDigits(view={}, object=0))
    assert isinstance(left, LostDigits)
    assert (left.lines, left.revision) == ([], 1)


def test_without_a_revision_there_is_nothing_to_judge(court: Court, tmp_path: Path) -> None:
    assert isinstance(court.ask(Verify(view={})), Failed)
    assert isinstance(court.ask(Restore(folder=str(tmp_path / "nowhere"))), Failed)
