"""Tradeoff: errors agree with independent code, fronts obey their laws, and the page shows what was measured."""

from __future__ import annotations

import csv
import json
import math
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import glshade
from glshade.image.metrics import METRICS, errors, largest
from glshade.page.ramp import heat
from glshade.scene.scene import Scene
from glshade.tradeoff import page
from glshade.tradeoff import study as studies
from glshade.tradeoff.front import Timing, dominated, ties
from glshade.tradeoff.setting import EXACT, KINDS, Setting, space
from glshade.tradeoff.study import Point, Study, study, timed
from glshade.verification.candidates import surfaces

Array = np.ndarray[Any, Any]
SCENES = Path(__file__).resolve().parents[3] / "scenes"
NAMES = ("matte", "glossy", "tight")
STORES = ("rgba32f", "rgba16f", "rgb10_a2", "r11f_g11f_b10f", "rgba8")
REFINED = Setting(shading="gouraud", refine=3e-2)
# Every rate with every storage, and light per vertex on a refined mesh.
SETTINGS = (*(Setting(shading=rate, storage=s) for rate in ("phong", "gouraud", "flat") for s in STORES), REFINED)


def small(name: str, size: tuple[int, int] = (96, 54)) -> Scene:
    """One of the three scenes for trade-offs, in a small picture. size: width, height [pixels]."""
    scene = glshade.load(SCENES / f"tradeoff-{name}.toml")
    return scene.model_copy(update={"film": scene.film.model_copy(update={"size": size})})


def pace(scene: Scene) -> float:
    """Returns a made-up time of a frame for a scene's quality, which is the same on every machine [s]."""
    quality = scene.quality
    shaded = {"flat": 1.0, "gouraud": 2.0, "phong": 4.0}[str(quality.shading)] + (quality.refine is not None)
    return 1e-3 * (shaded - 0.1 * STORES.index(str(quality.storage)))


def by_price(exact: Scene, scenes: Any, *_: Any) -> list[Timing]:
    """Returns a replacement of `timed` that returns made-up times."""
    return [Timing(t, 0.99 * t, 1.01 * t) for t in map(pace, (exact, *scenes))]


@pytest.fixture(scope="module")
def found(renderer: Any) -> dict[str, Study]:
    """The studies of the three scenes for trade-offs, with made-up times."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(studies, "timed", by_price)
        return {name: study(small(name), renderer, name=name, settings=SETTINGS) for name in NAMES}


def least(result: Study, **values: Any) -> Point:
    """Returns the most exact point whose knobs have these values."""
    points = [p for p in result.points if all(getattr(p.setting, knob) == value for knob, value in values.items())]
    return min(points, key=lambda p: p.total.max_abs)


@pytest.mark.slow
class TestFrontsOfTheScenes:
    """The lecture's statements about rates and lobes, confirmed by measurement."""

    def test_without_a_lobe_light_per_vertex_is_enough(self, found: dict[str, Study]) -> None:
        """One step of 8 bits is 0.004. The errors of 99.9 % of the pixels are about as small, in half the time of phong."""
        matte = found["matte"]
        assert least(matte, shading="gouraud", refine=None).total.p999 < 0.005
        assert least(matte, shading="flat").total.p999 > 0.01
        assert least(matte, shading="gouraud", refine=None) in self.front(matte)

    @pytest.mark.parametrize("name", ["glossy", "tight"])
    def test_a_lobe_needs_phong_or_triangles_narrower_than_it(self, name: str, found: dict[str, Study]) -> None:
        result = found[name]
        assert least(result, shading="gouraud", refine=None).total.max_abs > 0.1
        assert least(result, refine=3e-2).total.max_abs < 0.05
        assert least(result, shading="phong").total.max_abs < 1e-4
        # Refinement adds few vertices. Cutting every triangle in four would make four times as many.
        assert least(result, refine=3e-2).vertices < 2.5 * least(result, shading="gouraud", refine=None).vertices

    def test_the_fronts_differ_as_the_scenes_do(self, found: dict[str, Study]) -> None:
        """Of the settings on the front, those with an error below 0.05 differ between the scenes."""
        good = {
            name: {(p.setting.shading, p.setting.refine) for p in self.front(result) if p.total.max_abs < 0.05}
            for name, result in found.items()
        }
        assert good["matte"] == {("phong", None), ("gouraud", None)} | (good["matte"] & {("gouraud", 3e-2), ("flat", None)})
        assert good["glossy"] == good["tight"] == {("phong", None), ("gouraud", 3e-2)}

    def test_the_exact_setting_is_on_every_front(self, found: dict[str, Study]) -> None:
        for result in found.values():
            assert result.points[0].setting == EXACT
            assert all(result.front(metric)[0] is None for metric in ("max_abs", "rmse"))
            # The exact setting still has errors from the GPU's float32 arithmetic and from rounded inputs.
            assert result.points[0].total.max_abs < 1e-3
            assert 0 < result.floor.max_abs < 1e-3

    @staticmethod
    def front(result: Study, metric: str = "max_abs") -> list[Point]:
        return [p for p, by in zip(result.points, result.front(metric), strict=True) if by is None]


class TestErrors:
    """The errors of every point, computed again by independent code."""

    def test_all_points_again(self, found: dict[str, Study], renderer: Any) -> None:
        """Uses the public renderers and NumPy, and nothing of study but its settings."""
        result = found["glossy"]
        scene = small("glossy")
        plain = glshade.reference.render(scene, shading="phong").pixels.astype(np.float64)
        _, certain = surfaces(scene)
        assert result.counted == pytest.approx(certain.mean())
        for p in result.points:
            drawn = renderer.render(p.setting.applied(scene), dtype="float32").pixels[..., :3].astype(np.float64)
            off = np.abs(drawn - plain).max(axis=2)[certain]
            # The truth of the study is float64, while reference.render rounds it to float32.
            assert p.total.max_abs == pytest.approx(off.max(), abs=1e-7)
            assert p.total.rmse == pytest.approx(np.sqrt(np.mean(off**2)), abs=1e-7)
            assert p.total.p999 == pytest.approx(np.sort(off)[int(0.999 * (len(off) - 1))], rel=0.05, abs=1e-7)
            x, y = p.total.at
            assert np.abs(drawn - plain).max(axis=2)[y, x] == pytest.approx(p.total.max_abs, abs=1e-7)
            shown = [glshade.image.srgb.linear_to_srgb(c)[certain] for c in (drawn, plain)]
            codes = [np.floor(c * 255 + 0.5) for c in shown]
            assert p.total.codes == pytest.approx((codes[0] != codes[1]).mean(), abs=1e-3)
            assert p.total.non_finite == 0

    def test_kinds_again(self, found: dict[str, Study], renderer: Any) -> None:
        result, scene = found["glossy"], small("glossy")
        _, certain = surfaces(scene)
        setting = Setting(shading="gouraud", storage="rgb10_a2")
        (p,) = [p for p in result.points if p.setting == setting]

        def largest_of(one: Array, other: Array) -> float:
            return float(np.abs(one[..., :3].astype(np.float64) - other[..., :3]).max(axis=2)[certain].max())

        objects = [{**o.model_dump(), "shading": "gouraud"} for o in scene.objects]
        bare = Scene.model_validate({**scene.model_dump(), "objects": objects})
        truth, sampled = (glshade.reference.radiance(s) for s in (scene, bare))
        drawn = renderer.render(bare, dtype="float32").pixels.copy()
        stored = renderer.render(bare.model_copy(update={"quality": setting.quality}), dtype="float32").pixels.copy()
        assert p.by_kind["model"].max_abs == 0
        assert p.by_kind["sampling"].max_abs == pytest.approx(largest_of(sampled, truth), abs=1e-9)
        assert p.by_kind["arithmetic"].max_abs == pytest.approx(largest_of(drawn, sampled), abs=1e-9)
        assert p.by_kind["storage"].max_abs == pytest.approx(largest_of(stored, drawn), abs=1e-9)
        assert 0.5 / 1023 < p.by_kind["storage"].max_abs < 1.01 / 1023

    def test_kinds_explain_the_whole(self, found: dict[str, Study]) -> None:
        """The total error is at most the sum of the kinds' errors, because each is the difference from the picture before."""
        for result in found.values():
            for p in result.points:
                assert set(p.by_kind) == set(KINDS)
                assert p.total.max_abs <= sum(e.max_abs for e in p.by_kind.values()) + 1e-9

    def test_a_kind_that_is_not_chosen_is_no_error(self, found: dict[str, Study]) -> None:
        for result in found.values():
            for p in result.points:
                s = p.setting
                assert p.by_kind["model"].max_abs == 0
                assert (p.by_kind["sampling"].max_abs == 0) == (s.shading == "phong")
                assert (p.by_kind["storage"].max_abs == 0) == (s.storage == "rgba32f")

    def test_all_kinds_of_choice_at_once(self, renderer: Any) -> None:
        scene = Scene.model_validate(
            {
                "objects": [
                    {"shape": {"type": "icosphere", "subdivisions": 2}, "material": {"brdf": "phong", "exponent": 900, "ks": 1}}
                ],
                "film": {"size": (48, 48)},
            }
        )
        setting = Setting(specular="half_angle", normalise=False, arithmetic="fast", storage="rgba8")
        result = study(scene, renderer, settings=[EXACT, setting], repeat=1)
        p = result.points[1]
        assert all(p.by_kind[kind].max_abs > 1e-5 for kind in KINDS)
        assert p.total.max_abs <= sum(e.max_abs for e in p.by_kind.values()) + 1e-9

    def test_metrics_of_a_known_difference(self) -> None:
        truth = np.full((10, 20, 3), 0.5)
        picture = truth.astype(np.float32)
        assert errors(picture, truth).as_dict() == {
            **dict.fromkeys(METRICS, 0.0),
            "at": (0, 0),
            "non_finite": 0,
        }
        picture[3, 7, 1] += 0.25
        picture[9, 19] = np.nan
        found = errors(picture, truth)
        assert (found.max_abs, found.at, found.non_finite) == (0.25, (7, 3), 3)
        assert found.rmse == pytest.approx(0.25 / math.sqrt(199))
        assert found.codes == pytest.approx(1 / (199 * 3))
        # Pixels outside the mask are ignored.
        where = np.ones((10, 20), dtype=bool)
        where[3, 7] = False
        assert errors(picture, truth, where).max_abs == errors(picture, truth, where).flip == 0
        both = largest([found, errors(picture, truth, where)])
        assert both == found

    def test_pictures_that_are_not_finite_are_never_good(self, found: dict[str, Study]) -> None:
        """The metrics ignore infinite values, but the front must not take such a picture for an exact one."""
        result = found["matte"]
        first, second = result.points[0], result.points[1]
        broken = replace(second, total=replace(first.total, max_abs=0.0, rmse=0.0, non_finite=3))
        result = replace(result, points=(first, replace(broken, timing=first.timing)))
        assert all(result.points[1].error(metric) == math.inf for metric in METRICS)
        assert [result.front(metric) for metric in METRICS] == [[None, 0]] * len(METRICS)
        assert "not finite" in page.html(result, small("matte"), "max_abs", {})

    @pytest.mark.parametrize("film", [{}, {"background": (0, 0, 0, 0.5)}])
    def test_storage_that_the_scene_cannot_have_is_not_tried(self, film: dict[str, Any]) -> None:
        ball = {"shape": "sphere", "material": {"brdf": "lambert"}}
        scene = Scene.model_validate({"objects": [ball], "film": {"size": (8, 8), **film}})
        stores = {s.storage for s in space(scene, ("storage",))[0]}
        assert stores == set(STORES) - ({"r11f_g11f_b10f"} if film else set())
        dark = scene.model_copy(
            update={"lights": (glshade.LIGHTS["ambient"].model_validate({"type": "ambient", "intensity": -1}),)}
        )
        assert "r11f_g11f_b10f" not in {s.storage for s in space(dark, ("storage",))[0]}
        # Bands of wavelengths have negative weights.
        metal = {"brdf": "metal", "eta": {"spectrum": [[400, 1.5], [700, 0.2]]}}
        banded = Scene.model_validate({"objects": [{"shape": "sphere", "material": metal}], "film": {"size": (8, 8)}})
        assert {s.storage for s in space(banded, ("storage",))[0]} == {"rgba32f", "rgba16f"}


class TestSpace:
    """The space of settings."""

    def test_no_two_draw_the_same(self, renderer: Any) -> None:
        settings, inert = space(small("glossy"), ("shading", "normalise", "arithmetic", "fresnel"))
        assert settings[0] == EXACT
        assert list(inert) == ["fresnel=schlick"]
        assert "program" in inert["fresnel=schlick"]
        pictures = {renderer.render(s.applied(small("glossy")), dtype="float32").pixels.tobytes() for s in settings}
        assert len(pictures) == len(settings) == 8

    def test_inert_choices_change_no_pixel(self, renderer: Any) -> None:
        """Values that are reported to make no difference make none."""
        scene = small("matte")
        _, inert = space(scene, ("fresnel", "specular", "arithmetic"))
        assert {"fresnel=schlick", "specular=half_angle", "arithmetic=fast"} == set(inert)
        exact = renderer.render(EXACT.applied(scene), dtype="float32").pixels.copy()
        for setting in (Setting(fresnel="schlick"), Setting(specular="half_angle"), Setting(arithmetic="fast")):
            assert np.array_equal(renderer.render(setting.applied(scene), dtype="float32").pixels, exact)

    def test_samples_are_tried_below_the_films(self) -> None:
        scene = Scene.model_validate({"objects": [{"shape": "cube"}], "film": {"size": (8, 8), "samples": 4}})
        assert {s.samples for s in space(scene, ("samples",))[0]} == {None, 2, 1}

    def test_settings_have_different_names(self) -> None:
        settings, _ = space(small("glossy"), ("specular", "shading", "subdivide", "arithmetic", "storage"))
        assert len({str(s) for s in settings}) == len(settings)
        assert all(Setting(**s.as_dict()) == s for s in settings)


timings = st.tuples(st.floats(1, 10), st.floats(0, 2), st.floats(0, 2)).map(
    lambda t: Timing(t[0], max(t[0] - t[1], 0.1), t[0] + t[2])
)
measured = st.lists(st.tuples(timings, st.sampled_from([0.0, 1e-6, 1e-3, 0.1, math.inf])), min_size=1, max_size=12)


class TestDominated:
    """The laws of the front."""

    @given(points=measured)
    def test_laws(self, points: list[tuple[Timing, float]]) -> None:
        by = dominated([t for t, _ in points], [e for _, e in points])
        assert None in by
        for j, i in enumerate(by):
            if i is None:
                continue
            (one, error), (other, worse) = points[i], points[j]
            assert error <= worse
            # The dominating point is not slower, and it is more exact or faster.
            assert one.median < other.median or ties(one, other)
            assert error < worse or (one.median < other.median and not ties(one, other))
            # Following the dominating points never comes back to the same point.
            seen = {j}
            while i is not None:
                assert i not in seen
                seen.add(i)
                i = by[i]

    @given(points=measured)
    def test_no_point_of_the_front_beats_another(self, points: list[tuple[Timing, float]]) -> None:
        by = dominated([t for t, _ in points], [e for _, e in points])
        front = [points[i] for i, dominator in enumerate(by) if dominator is None]
        for one, error in front:
            for other, less in front:
                assert not (less < error and (other.median < one.median or ties(one, other)))
        # Along the front, slower points are more exact.
        for one, error in front:
            for other, less in front:
                assert less < error or one.median >= other.median or less == error

    @given(points=measured, seed=st.integers(0, 99))
    def test_the_order_does_not_matter(self, points: list[tuple[Timing, float]], seed: int) -> None:
        order = np.random.default_rng(seed).permutation(len(points))
        one = dominated([t for t, _ in points], [e for _, e in points])
        other = dominated([points[i][0] for i in order], [points[i][1] for i in order])
        assert [one[i] is None for i in order] == [by is None for by in other]

    def test_noise_decides_nothing(self) -> None:
        quick, slow = Timing(1.0, 0.9, 1.1), Timing(1.05, 0.95, 1.2)
        assert dominated([quick, slow], [0.1, 0.1]) == [None, None]
        assert dominated([quick, slow], [0.2, 0.1]) == [1, None]
        assert dominated([quick, Timing(2.0, 1.9, 2.1)], [0.1, 0.1]) == [None, 0]


class TestTakenUp:
    """Studies that were interrupted and continued."""

    SETTINGS = (EXACT, *(Setting(shading=rate, storage=s) for rate in ("gouraud", "flat") for s in STORES))

    def test_the_same_points_without_measuring(self, renderer: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        scene, kept = small("matte", (32, 18)), tmp_path / "measured.json"
        first = study(scene, renderer, settings=self.SETTINGS, repeat=2, kept=kept)
        with monkeypatch.context() as patch:
            patch.setattr(studies, "timed", lambda *_: pytest.fail("measured again"))
            again = study(scene, renderer, settings=self.SETTINGS, repeat=2, kept=kept)
            assert again == first
        # Another size or another number of timings makes it another study.
        for other, repeat in ((small("matte", (32, 19)), 2), (scene, 3)):
            with monkeypatch.context() as patch:
                patch.setattr(studies, "timed", lambda *_: 1 / 0)
                with pytest.raises(ZeroDivisionError):
                    study(other, renderer, settings=self.SETTINGS, repeat=repeat, kept=kept)

    def test_finished_points_are_kept(self, renderer: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        scene, kept = small("matte", (32, 18)), tmp_path / "measured.json"

        def interrupted(_: str, done: int, total: int) -> None:
            if done == 9:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            study(scene, renderer, settings=self.SETTINGS, repeat=1, kept=kept, progress=interrupted)
        before = json.loads(kept.read_text())["points"]
        assert len(before) == studies.TOGETHER - 1
        timed, seen = studies.timed, []

        def counted(exact: Any, scenes: Any, *rest: Any) -> Any:
            seen.extend(scenes)
            return timed(exact, scenes, *rest)

        monkeypatch.setattr(studies, "timed", counted)
        result = study(scene, renderer, settings=self.SETTINGS, repeat=1, kept=kept)
        assert len(result.points) == len(self.SETTINGS)
        assert len(seen) == len(self.SETTINGS) - len(before)
        after = {p["name"]: p for p in json.loads(kept.read_text())["points"]}
        assert all(after[p["name"]] == p for p in before)

    @pytest.mark.parametrize("text", ["", "{", "[]", '{"of": {}}'])
    def test_a_broken_file_is_replaced(self, text: str, renderer: Any, tmp_path: Path) -> None:
        kept = tmp_path / "measured.json"
        kept.write_text(text)
        study(small("matte", (16, 9)), renderer, settings=[EXACT], repeat=1, kept=kept)
        assert len(json.loads(kept.read_text())["points"]) == 1
        assert [p.name for p in tmp_path.iterdir()] == ["measured.json"]


@pytest.fixture(scope="module")
def folder(found: dict[str, Study], renderer: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the page of the glossy scene."""
    folder = tmp_path_factory.mktemp("page")
    assert page.write(folder, found["glossy"], small("glossy"), renderer) == folder / "index.html"
    return folder


class Reader(HTMLParser):
    """An HTML page as a list of elements; checks that each is closed.

    elements: (tag, attributes) in the order of the page.
    open: the tags of elements that are not closed.
    text: tag -> the texts within it.
    """

    VOID = ("meta", "link", "input", "img", "br", "path", "circle")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text: dict[str, list[str]] = {}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.setdefault(self.open[-1] if self.open else "", []).append(data)

    def with_class(self, name: str) -> list[dict[str, str | None]]:
        """Returns the attributes of all elements of a class."""
        return [a for _, a in self.elements if name in (a.get("class") or "").split()]


class TestPage:
    """The page index.html and the files beside it."""

    def test_holds_every_point_on_every_chart(self, folder: Path, found: dict[str, Study]) -> None:
        result = found["glossy"]
        read = Reader((folder / "index.html").read_text(encoding="utf-8"))
        assert not read.open
        charts = [a for tag, a in read.elements if tag == "svg" and "data-metric" in a]
        assert [a["data-metric"] for a in charts] == list(METRICS)
        marks = [a for a in read.with_class("mark") if "data-i" in a]
        assert len(marks) == len(result.points) * len(METRICS)
        on_front = sum(by is None for metric in METRICS for by in result.front(metric))
        assert len([a for a in marks if "front" in str(a["class"])]) == on_front

    def test_marks_are_ordered_by_time_and_error(self, found: dict[str, Study]) -> None:
        """Faster points are further left, more exact ones further down, and all are inside the plot."""
        for result in found.values():
            for metric in METRICS:
                chart = page.Chart(result, metric)
                left, top, right, bottom = chart.plot
                marks = sorted(chart.marks, key=lambda m: m.index)
                assert all(left <= m.low <= m.x <= m.high <= right and top <= m.y <= bottom for m in marks)
                for one, p in zip(marks, result.points, strict=True):
                    for other, q in zip(marks, result.points, strict=True):
                        assert p.timing.median > q.timing.median or one.x <= other.x
                        assert p.error(metric) > q.error(metric) or one.y >= other.y
                assert all(left <= x <= right for x, _ in chart.columns)
                assert all(top - 1 <= y <= bottom + 1 for y, _ in chart.rows)
                assert len(list(chart.columns)) >= 3

    def test_the_line_steps_down_from_point_to_point(self, found: dict[str, Study]) -> None:
        for result in found.values():
            chart = page.Chart(result, "max_abs")
            start = re.match(r"M([\d.]+) ([\d.]+)", chart.line)
            steps = re.findall(r"H([\d.]+)V([\d.]+)", chart.line)
            assert start
            corners = [tuple(map(float, pair)) for pair in (start.groups(), *steps)]
            front = {(m.x, m.y) for m in chart.marks if m.number is not None}
            assert set(corners) == front
            # SVG's y grows downward.
            assert corners == sorted(corners)

    def test_needs_no_other_files(self, folder: Path) -> None:
        read = Reader((folder / "index.html").read_text(encoding="utf-8"))
        links = [a[key] or "" for _, a in read.elements for key in ("href", "src") if key in a]
        assert links
        assert all((folder / link).is_file() for link in links)
        text = (folder / "index.html").read_text(encoding="utf-8")
        assert not re.search(r"https?://|@import|url\(|<link|fetch\(", text)
        names = set(re.findall(r'"file": ?"([^"]+)"', text))
        assert names
        assert {p.name for p in (folder / "pictures").iterdir()} == {f"{n}{end}.png" for n in names for end in ("", "-error")}

    def test_pictures_are_those_of_the_front(self, folder: Path, found: dict[str, Study], renderer: Any) -> None:
        result = found["glossy"]
        front = {i for metric in METRICS for i, by in enumerate(result.front(metric)) if by is None}
        assert len(list((folder / "pictures").iterdir())) == 2 * len(front)
        exact, _ = glshade.image.file.read(folder / "pictures" / "phong-rgba32f.png", "linear")
        drawn = renderer.render(EXACT.applied(small("glossy")), dtype="float32").pixels
        assert np.abs(exact[..., :3] - glshade.image.srgb.linear_to_srgb(drawn)).max() <= 0.51 / 255

    def test_size_is_limited(
        self, folder: Path, found: dict[str, Study], renderer: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        assert (folder / "index.html").stat().st_size < 5_000_000
        monkeypatch.setattr(page, "PAGE", page.POINT * len(found["glossy"].points) + 27_000)
        page.write(tmp_path, found["glossy"], small("glossy"), renderer)
        data = (tmp_path / "index.html").read_text(encoding="utf-8")
        embedded = [len(b) * 3 // 4 for b in re.findall(r'"(?:picture|error)": ?"([\w+/=]{200,})"', data)]
        # The last pair of pictures may exceed the limit.
        assert 20_000 <= sum(embedded) < 20_300 + 2 * max(embedded)
        assert len(list((tmp_path / "pictures").iterdir())) == len(list((folder / "pictures").iterdir()))

    def test_texts_are_escaped(self, found: dict[str, Study]) -> None:
        scene = small("matte").model_copy(update={"description": "a < b </script><script>alert(1)</script>"})
        text = page.html(found["matte"], scene, "max_abs", {0: {"file": "</script>"}})
        assert "<script>alert" not in text
        harmless = page.html(found["matte"], small("matte"), "max_abs", {0: {"file": "a"}})
        assert text.count("</script>") == harmless.count("</script>")
        assert "a &lt; b" in text

    def test_csv_and_json_have_the_same_numbers(self, folder: Path, found: dict[str, Study]) -> None:
        result = found["glossy"]
        data = json.loads((folder / "tradeoff.json").read_text(encoding="utf-8"))
        assert data == json.loads(json.dumps(result.as_dict()))
        with (folder / "tradeoff.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == len(data["points"]) == len(result.points)
        for row, p, by in zip(rows, data["points"], result.front("rmse"), strict=True):
            assert row["setting"] == p["name"]
            assert float(row["seconds"]) == p["seconds"]["median"]
            assert float(row["max_abs"]) == p["total"]["max_abs"]
            assert float(row["storage_rmse"]) == p["by_kind"]["storage"]["rmse"]
            assert row["dominated_by_rmse"] == ("" if by is None else str(result.points[by].setting))
            assert p["dominated_by"]["rmse"] == by

    def test_one_scale_for_all_maps(self) -> None:
        """A colour stands for the same error in all pictures."""
        uniform, varied = heat(np.full((2, 2), 1e-3), 1.0)[0], heat(np.array([[1e-3, 0.5]] * 2), 1.0)[0]
        assert np.array_equal(uniform[0, 0], varied[0, 0])
        assert varied[0, 1].sum() > varied[0, 0].sum()

    @pytest.mark.parametrize(
        ("value", "metric", "text"),
        [
            (0.0, "rmse", "0"),
            (0.0123456, "rmse", "0.0123"),
            (8.23e-6, "rmse", "8.2e-6"),
            (1e-8, "rmse", "1e-8"),
            (0.0012, "codes", "0.12%"),
            (0.5861, "codes", "58.6%"),
            (0.0, "codes", "0%"),
            (6.1e-6, "codes", "0.00061%"),
            (math.inf, "flip", "not finite"),
            (1.5, "max_abs", "1.5"),
        ],
    )
    def test_numbers(self, value: float, metric: str, text: str) -> None:
        assert page.error_text(value, metric) == text

    def test_ties_share_a_place(self, found: dict[str, Study]) -> None:
        result = found["matte"]
        first = result.points[0]
        second = Point(Setting(arithmetic="fast"), first.timing, first.vertices, first.total, first.by_kind)
        both = Study(result.scene, result.digest, result.driver, result.size, result.counted, (first, second), {}, result.floor)
        assert [(r.number, r.index, r.tie) for r in page.ranks(both, "rmse")] == [(1, 0, False), (1, 1, True)]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function that runs `glshade tradeoff` in a folder with s.toml, and returns (exit code, stdout, stderr)."""
    text = (SCENES / "tradeoff-glossy.toml").read_text().replace("[480, 270]", "[48, 27]")
    (tmp_path / "s.toml").write_text(text)
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str, str]:
        from glshade.cli import run as main

        monkeypatch.setattr(sys, "argv", ["glshade", "tradeoff", *map(str, arguments)])
        with pytest.raises(SystemExit) as exit:
            main()
        return int(exit.value.code or 0), *capsys.readouterr()

    return run


class TestCommand:
    """The command `glshade tradeoff`."""

    QUICK = ("--knobs", "shading,storage", "--repeat", "1")

    def test_writes_a_folder_and_prints_the_front(self, run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(studies, "timed", by_price)
        code, out, err = run("s.toml", *self.QUICK)
        assert code == 0
        folder = tmp_path / "tradeoff-s"
        assert {p.name for p in folder.iterdir()} == {
            "index.html",
            "tradeoff.json",
            "tradeoff.csv",
            "measured.json",
            "pictures",
        }
        assert out.splitlines()[-1] == "page: tradeoff-s/index.html"
        assert "15 settings" in out
        assert re.search(r"^1 +flat, \w+ ", out, flags=re.MULTILINE)
        assert re.search(r"^\d+ +phong, rgba32f .* 0 .* 0 .*e-\d", out, flags=re.MULTILINE)
        # Each setting is listed once, on the front or as dominated.
        rows = [line for line in out.splitlines() if re.match(r"(\d+|tie) .* ms|(\d+|tie)  |.*: dominated by ", line)]
        assert len(rows) == 15
        assert err.splitlines()[-1].startswith("glshade: 15 of 15 settings measured")
        # The file has all measurements, so that nothing is measured again without --again.
        monkeypatch.setattr(studies, "timed", lambda *_: 1 / 0)
        assert run("s.toml", *self.QUICK)[:2] == (0, out)
        with pytest.raises(ZeroDivisionError):
            run("s.toml", *self.QUICK, "--again")

    def test_json(self, run: Any, tmp_path: Path) -> None:
        code, out, _ = run("s.toml", "-o", "x", "--knobs", "storage", "--repeat", 1, "--size", "32x18", "--json")
        data = json.loads(out)
        assert code == 0
        assert data == json.loads((tmp_path / "x" / "tradeoff.json").read_text())
        assert (data["size"], data["scene"], len(data["points"])) == ([32, 18], "s", 5)

    def test_set(self, run: Any, tmp_path: Path) -> None:
        matte = ("--set", "materials.surface.ks=0", "--set", "materials.ground.ks=0")
        assert run("s.toml", *matte, "--knobs", "arithmetic,specular", "--repeat", 1)[0] == 0
        data = json.loads((tmp_path / "tradeoff-s" / "tradeoff.json").read_text())
        assert len(data["points"]) == 1
        assert set(data["inert"]) == {"arithmetic=fast", "specular=half_angle"}

    def test_interrupted(self, run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        timed, calls = studies.timed, []

        def impatient(*arguments: Any) -> Any:
            calls.append(1)
            if len(calls) == 2:
                raise KeyboardInterrupt
            return timed(*arguments)

        monkeypatch.setattr(studies, "timed", impatient)
        code, _, err = run("s.toml", *self.QUICK)
        assert code == 130
        assert "tradeoff-s/measured.json holds the measurements so far; the same command continues" in err
        assert [p.name for p in (tmp_path / "tradeoff-s").iterdir()] == ["measured.json"]
        assert run("s.toml", *self.QUICK)[0] == 0
        # The 15 settings are three batches, the first of which was done before the interruption.
        assert len(calls) == 4

    @pytest.mark.parametrize(
        ("arguments", "code", "message"),
        [
            (("s.toml", "--knobs", "shadng"), 2, "no knob is named 'shadng'; did you mean \"shading\"?"),
            (("s.toml", "--knobs", "xyzzy"), 2, "no knob is named 'xyzzy'; allowed: arithmetic, fresnel"),
            (("s.toml", "--metric", "ssim"), 2, "'ssim' is not one of"),
            (("s.toml", "--repeat", "0"), 2, "--repeat"),
            (("none.toml",), 3, "none.toml"),
            (("s.toml", "--set", "materials.surface.exponent=-1"), 3, "exponent"),
            (("s.toml", "-o", "s.toml/x"), 1, "cannot be made: Not a directory"),
            (("s.toml", "--device", "99"), 5, "there is no EGL device 99"),
        ],
    )
    def test_faulty_arguments(self, arguments: tuple[str, ...], code: int, message: str, run: Any, tmp_path: Path) -> None:
        exit_code, out, err = run(*arguments)
        assert (exit_code, out) == (code, "")
        assert message in err
        assert not list(tmp_path.glob("**/*.html"))

    def test_offers_all_metrics(self) -> None:
        from glshade.cli.tradeoff import command

        (option,) = [p for p in command.params if p.name == "metric"]
        assert tuple(option.type.choices) == METRICS
        assert set(page.METRIC_MEANINGS) == set(METRICS)
        assert set(page.KIND_MEANINGS) == set(KINDS)
        (repeat,) = [p for p in command.params if p.name == "repeat"]
        assert f"[default: {studies.REPEAT}]" in repeat.help

    def test_the_scenes_are_one_scene(self) -> None:
        """The three scenes differ only in their lobes."""
        scenes = [glshade.load(SCENES / f"tradeoff-{name}.toml") for name in NAMES]
        assert {m.exponent for m in scenes[1].materials.values()} == {200}
        assert {m.exponent for m in scenes[2].materials.values()} == {20000}
        for scene in scenes:
            assert scene.description
            bare = {"description": "", "materials": {}}
            assert scene.model_copy(update=bare) == scenes[0].model_copy(update=bare)


@pytest.mark.slow
def test_real_times_on_the_whole_space(renderer: Any) -> None:
    """With real times and all knobs, phong is on the front, and without refinement every other rate has large errors."""
    result = study(small("tight", (320, 180)), renderer)
    front = {result.points[i].setting for i, by in enumerate(result.front()) if by is None}
    assert len(result.points) == 200
    assert any(s.shading == "phong" for s in front)
    assert all(p.total.max_abs > 0.05 for p in result.points if p.setting.shading != "phong" and p.setting.refine is None)
    assert all(p.total.max_abs <= sum(e.max_abs for e in p.by_kind.values()) + 1e-9 for p in result.points)


class Stopwatch:
    """A stand-in for a renderer, whose drawings take given times [s]."""

    def __init__(self, times: list[float]) -> None:
        self._times = iter(times)

    def drawing(self, _: Any) -> Any:
        return lambda: next(self._times)


@given(st.lists(st.floats(1e-6, 1e3), min_size=12, max_size=12))
def test_no_time_is_below_zero(times: list[float]) -> None:
    """However noisy the machine is, the range of a time is positive and holds the median, so that a chart can show it."""
    scene: Any = None
    for timing in timed(scene, [scene, scene], Stopwatch(times), repeat=4):  # type: ignore[arg-type]
        assert 0 < timing.low <= timing.median * (1 + 1e-12)
        assert timing.median <= timing.high * (1 + 1e-12)


def test_kept_times_below_zero_are_measured_again(found: dict[str, Study], tmp_path: Path) -> None:
    """A file of measurements with a range that reaches below zero counts as broken, so that the study measures anew."""
    point, head = found["tight"].points[0], {"digest": "a"}
    kept = tmp_path / "measured.json"
    for low, known in ((point.timing.low, 1), (-1e-6, 0)):
        changed = replace(point, timing=replace(point.timing, low=low))
        studies._write(kept, head, {point.setting: changed})
        assert len(studies._read(kept, head)) == known
