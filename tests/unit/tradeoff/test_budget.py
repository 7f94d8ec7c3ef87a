"""Budgets: chosen settings stay within their limits on old and new views, and impossible budgets are errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade import Renderer, Scene, reference
from glshade.cli import cli
from glshade.cli._options import Duration
from glshade.image.metrics import METRICS, errors
from glshade.tradeoff import budget
from glshade.tradeoff.budget import choose, within_deadline
from glshade.tradeoff.choice import BudgetError, Choice, applied, parse, simplest
from glshade.tradeoff.front import Timing
from glshade.tradeoff.setting import EXACT, Setting, drawn_from
from glshade.tradeoff.views import views_around
from glshade.verification.candidates import surfaces

# The number of views, few so that the tests are fast.
FEW = 6


def scene(**more: Any) -> Scene:
    """Returns a scene of a glossy ball, and a matte one far behind it. more: further keys of the scene."""
    objects = [
        {
            "name": "hero",
            "shape": {"type": "sphere", "segments": 32, "rings": 16},
            "material": {"brdf": "phong", "kd": 0.3, "ks": 0.5, "exponent": 400},
        },
        {
            "name": "far",
            "shape": {"type": "sphere", "segments": 32, "rings": 16},
            "material": {"brdf": "lambert", "kd": 0.6},
            "transform": {"translate": (-2.5, 0, -3), "scale": 0.6},
        },
    ]
    lights = [{"type": "point", "position": (3 * (i % 2) - 1.5, 2 + i, 3), "intensity": 0.5} for i in range(4)]
    camera = {"eye": (0, 0.5, 6), "target": (-0.5, 0, -1)}
    return Scene.model_validate({"film": {"size": (96, 96)}, "camera": camera, "objects": objects, "lights": lights, **more})


def error_elsewhere(scene: Scene, choice: Choice, renderer: Renderer, metric: str, count: int) -> list[float]:
    """Returns the errors on `count` views that the choice was not tried on, computed without the code under test."""
    result = []
    for view in views_around(scene, count + 1, start=1.7)[1:]:
        exact = applied(view, [EXACT] * len(scene.objects))
        _, certain = surfaces(exact)
        picture = renderer.render(applied(view, choice.settings), dtype="float32").pixels[..., :3]
        result.append(getattr(errors(picture, reference.radiance(exact)[..., :3], certain), metric))
    return result


@pytest.mark.parametrize(("metric", "limit"), [("max_abs", 5e-2), ("rmse", 2e-3), ("codes", 0.1)])
def test_a_budget_is_met_where_it_was_tried_and_elsewhere(metric: str, limit: float, renderer: Renderer) -> None:
    choice = choose(scene(), renderer, {metric: limit}, count=FEW, keep=False)
    assert getattr(choice.errors, metric) <= limit
    assert choice.views == FEW
    assert choice.seconds <= choice.exact_seconds
    elsewhere = error_elsewhere(scene(), choice, renderer, metric, 8)
    assert np.mean(np.array(elsewhere) <= limit) >= 0.75, "few views do not bound all others, but most must be within the limit"
    words = choice.summary(scene())
    assert f"verified on {FEW} views" in words
    assert "to spare" in words
    assert "guarantee" not in words


def test_objects_are_chosen_for_one_by_one(renderer: Renderer) -> None:
    """With a limit between their errors, the matte ball is shaded per vertex and the glossy one is not."""
    measured = budget._Measurements(scene(), renderer, FEW)
    gouraud = Setting(shading="gouraud")
    by_view = [measured._group_errors(view, measured._drawn(view, [gouraud] * 2)) for view in measured.views]
    hero, far = (max(groups[group]["max_abs"] for groups in by_view if group in groups) for group in range(2))
    assert measured.groups == [[0], [1]]
    assert far < hero / 2
    timing = Timing(1.0, 1.0, 1.0)
    assert measured.by_group([(gouraud, timing)], {"max_abs": (hero + far) / 2}) == [EXACT, gouraud]
    assert measured.by_group([(gouraud, timing)], {"max_abs": hero * 1.01}) == [gouraud, gouraud]
    assert measured.by_group([(gouraud, timing)], {"max_abs": far / 2}) == [EXACT, EXACT]


def test_values_that_change_nothing_for_an_object_are_left_out() -> None:
    """Lambert's model has no highlight, no Fresnel term and no power, so these knobs say nothing about the matte ball."""
    fast = Setting(shading="gouraud", subdivide=1, specular="half_angle", fresnel="schlick", arithmetic="fast")
    found = simplest(scene(), [fast, fast])
    assert found == [
        Setting(shading="gouraud", subdivide=1, specular="half_angle", arithmetic="fast"),
        Setting(shading="gouraud", subdivide=1),
    ]
    assert drawn_from(applied(scene(), found)) == drawn_from(applied(scene(), [fast, fast]))
    assert simplest(scene(), found) == found


def test_the_words_of_a_choice_name_only_what_matters_and_compare_times_by_ratio(renderer: Renderer) -> None:
    timed = {EXACT: 4e-3, Setting(specular="half_angle"): 2e-3, Setting(shading="gouraud", specular="half_angle"): 3e-3}
    uniform = [(setting, Timing(t, t, t)) for setting, t in sorted(timed.items(), key=lambda pair: pair[1])]
    measured = budget._Measurements(scene(), renderer, 2)
    measured.exact = Timing(4e-3, 4e-3, 4e-3)
    chosen = simplest(scene(), [Setting(specular="half_angle")] * 2)
    limits = {"max_abs": 10.0}
    runner_up = measured.runner_up(chosen, uniform, limits, share=0.5)
    assert runner_up.startswith("gouraud, half_angle for all takes 1.50 times as long, max_abs ")
    choice = Choice(tuple(chosen), limits, measured.errors(chosen), 1e-3, 2e-3, 2, runner_up)
    assert choice.summary(scene()).splitlines()[:2] == ["hero: phong, half_angle", "far: phong"]


def test_impossible_budgets_are_errors_that_name_the_least_possible(renderer: Renderer) -> None:
    with pytest.raises(
        BudgetError, match=r"no setting meets the budget on 2 views: max_abs 1e-12 \(at least .*e-0\d\)"
    ) as caught:
        choose(scene(), renderer, {"max_abs": 1e-12}, count=2, keep=False)
    assert 0 < caught.value.least["max_abs"] < 1e-4
    assert caught.value.exit_code == 2
    with pytest.raises(BudgetError, match="the fastest takes"):
        within_deadline(scene(), renderer, 1e-9, count=2)


def test_a_deadline_is_kept_with_the_least_error(renderer: Renderer) -> None:
    choice = within_deadline(scene(), renderer, 10.0, count=2)
    assert choice.errors.max_abs < 1e-4
    assert choice.seconds <= 10


def test_a_choice_is_cached(renderer: Renderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = choose(scene(), renderer, {"max_abs": 0.5}, count=2)
    (kept,) = tmp_path.glob("glshade/budgets/*.json")
    monkeypatch.setattr(budget, "_Measurements", None)
    assert choose(scene(), renderer, {"max_abs": 0.5}, count=2) == first
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kept.write_text("{")
    again = choose(scene(), renderer, {"max_abs": 0.5}, count=2)
    assert again.limits == first.limits
    assert kept.read_text() != "{"


def test_views_surround_the_scene() -> None:
    found = views_around(scene(), 9)
    assert found[0].camera == scene().camera
    eyes = [np.array(view.camera.eye) for view in found]
    distances = [np.linalg.norm(eye - (-0.5, 0, -1)) for eye in eyes]
    assert distances == pytest.approx([distances[0]] * 9)
    assert min(np.linalg.norm(a - b) for i, a in enumerate(eyes) for b in eyes[:i]) > 0.5
    assert all(set(view.film.size) == {96} for view in views_around(scene(), 2))
    large = scene(film={"size": (4000, 2000), "samples": 4})
    assert views_around(large, 1)[0].film.size == (384, 192)
    assert views_around(large, 1)[0].film.samples == 1


@pytest.mark.parametrize(
    ("text", "fault"),
    [("max=1", "metrics: max_abs"), ("max_abs", "is not a number"), ("rmse=x", "'x'"), ("flip=0", "more than 0")],
)
def test_faulty_budgets(text: str, fault: str) -> None:
    with pytest.raises(ValueError, match=fault):
        parse([text])


@settings(max_examples=20)
@given(limits=st.dictionaries(st.sampled_from(METRICS), st.floats(1e-9, 1e3), min_size=1))
def test_budgets_are_parsed(limits: dict[str, float]) -> None:
    assert parse([f"{metric}={limit!r}" for metric, limit in limits.items()]) == limits


@pytest.mark.parametrize(("text", "seconds"), [("5ms", 5e-3), ("5", 5e-3), ("0.2s", 0.2), ("1e-1 ms", 1e-4)])
def test_times_are_parsed(text: str, seconds: float) -> None:
    assert Duration().convert(text, None, None) == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("--deadline", "0ms"), "'0ms' is not a time such as 5ms"),
        (("--deadline", "soon"), "'soon' is not a time"),
        (("--deadline", "1s", "--shading", "flat"), "choose the settings"),
        (("--budget", "max=1"), "metrics: max_abs"),
        (("--budget", "rmse=1", "--deadline", "1s"), "choose the settings"),
    ],
)
def test_faulty_options_of_the_command(arguments: tuple[str, ...], fault: str, tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text('objects = [{ shape = "cube" }]\n')
    result = CliRunner().invoke(cli, ["render", str(path), *arguments])
    assert result.exit_code == 2
    assert fault in result.output
