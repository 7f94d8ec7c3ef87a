"""The judge: verdicts, probes and references of the very views that pages show."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.drawn import FROM_ABOVE, SCENE, Drawn, drawn, pixels_of

from glshade import load, reference
from glshade.live.judge import Judge
from glshade.live.messages import Answer, Failed, Frame, Heat, Judged, Loaded, Probe, Probed, Reference, Restore, Verify

# A model in GLSL alone.
GLEAM = """// A test.
struct Gleam {
    vec3 kd;  // [0, 1] default [0.5, 0.5, 0.5]: colour
};

vec3 brdf_cos(Gleam m, Frame f, vec3 l, vec3 v) {
    return m.kd * dot(f.n, l);
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
        assert verdict.revision == 1


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


def test_a_model_without_a_reference_has_no_verdict(court: Court) -> None:
    court.live.write("gleam", '#include "surface/frame.glsl"\n' + GLEAM)
    court.live.scene.write_text(SCENE.replace('brdf = "lambert"', 'brdf = "gleam"'))
    court.restore()
    verdict = court.verdict()
    assert verdict.verdict == "none"
    assert "no reference" in verdict.text


def test_without_a_revision_there_is_nothing_to_judge(court: Court, tmp_path: Path) -> None:
    assert isinstance(court.ask(Verify(view={})), Failed)
    assert isinstance(court.ask(Restore(folder=str(tmp_path / "nowhere"))), Failed)
