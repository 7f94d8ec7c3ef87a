"""The corpus of `glshade bench compare`: each regression changes its picture, each noise hardly does, and a run can go on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glshade import Renderer
from glshade.bench.corpus.case import Case, codes_of, differing, linear_of
from glshade.bench.corpus.drawing import draw_elsewhere, draw_file
from glshade.bench.corpus.kinds import Noise, Regression
from glshade.bench.corpus.making import Item, Made, make, planned, suffix
from glshade.bench.corpus.noises import NOISES
from glshade.bench.corpus.regressions import REGRESSIONS
from glshade.bench.corpus.scenes import SCENES, write_scene
from glshade.errors import GlshadeError
from glshade.image import file as picture_file
from glshade.scene.file import load

# Width and height of the pictures of these tests [pixels].
SMALL = (48, 32)
# Kinds that need another scene than "rates" -> that scene.
HOMES = {
    "not-a-number": "near",
    "alpha-multiplied-again": "solids",
    "alpha-lost": "solids",
    "lamp-moved": "near",
    "falloff-wrong": "falloffs",
    "texture-shifted": "textured",
    "level-of-detail-wrong": "textured",
    "depth-coarse": "textured",
    "depth-reversed": "textured",
    "object-turned": "textured",
}
# Kinds that change less than 10 pixels of the pictures of these tests, which are smaller than those of the corpus, by more than
# 2 codes.
FAINT = {"normals-not-normalised"}
# Noises that may move outlines by a part of a pixel. In small pictures, outlines are a large share.
OUTLINES = 0.25


@pytest.fixture(scope="module")
def cases(renderer: Renderer, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """`cases(name)` is the case of a scene, with a small picture."""
    folder, known = tmp_path_factory.mktemp("corpus"), {}

    def case(name: str) -> Case:
        if name not in known:
            path = write_scene(folder, name, SMALL)
            picture = path.with_name(f"baseline{suffix(name)}")
            draw_file(renderer, path, picture)
            known[name] = Case(name, load(path), picture, renderer)
        return known[name]

    return case


def files(folder: Path) -> dict[str, bytes]:
    """Returns the bytes of all files in a folder, by path."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def ordinary(kinds: Any, *drawn: str) -> list[Any]:
    """Returns the names of the kinds that have a function to make pixels, as parameters.

    Those that draw are slow, because they need programs of their own; the ordinary run tests only a few of them.
    drawn: the kinds that draw and that the ordinary run tests.
    """
    quick = ("regressions.pictures", "noises.pictures")
    return [
        pytest.param(name, marks=() if name in drawn or kind.make.__module__.endswith(quick) else pytest.mark.slow)
        for name, kind in sorted(kinds.items())
        if kind.make is not None
    ]


class TestKinds:
    """The functions that make the test pictures."""

    def test_there_are_forty_of_each_group_and_ten_scenes(self) -> None:
        assert len(REGRESSIONS) >= 40
        assert len(NOISES) >= 40
        assert len(SCENES) == 10

    @pytest.mark.parametrize("kind", [*REGRESSIONS.values(), *NOISES.values()], ids=lambda kind: kind.name)
    def test_each_says_in_a_sentence_what_it_is(self, kind: Regression | Noise) -> None:
        text = kind.description if isinstance(kind, Regression) else kind.reason
        assert text[0].isupper() or text.startswith("llvmpipe") or text[0].isdigit()
        assert text.endswith(".")

    def test_each_regression_has_three_strengths(self) -> None:
        assert {len(kind.strengths) for kind in REGRESSIONS.values()} == {3}

    @pytest.mark.parametrize("name", ordinary(REGRESSIONS, "camera-wider", "object-lost", "rate-lower", "light-weaker"))
    def test_a_regression_changes_the_picture_and_its_strongest_form_visibly(self, name: str, cases: Any) -> None:
        case, kind = cases(HOMES.get(name, "rates")), REGRESSIONS[name]
        pixels = kind.make(case, kind.strengths[0])
        assert pixels is not None
        assert (pixels.shape, pixels.dtype) == (case.baseline.shape, case.baseline.dtype)
        assert differing(case.baseline, pixels, 2) >= (1 if name in FAINT else 10)

    @pytest.mark.parametrize("name", ordinary(NOISES, "snapped-to-16", "power-rounded", "triangles-begin-elsewhere"))
    def test_a_noise_moves_codes_by_one_and_outlines_by_a_part_of_a_pixel(self, name: str, cases: Any) -> None:
        # The scene "solids" has one sample a pixel, surfaces that cut through each other, and alpha.
        case, make_ = cases("solids"), NOISES[name].make
        assert make_ is not None
        pixels = make_(case)
        assert (pixels.shape, pixels.dtype) == (case.baseline.shape, case.baseline.dtype)
        moved = (np.abs(pixels.astype(int) - case.baseline) > 1).any(axis=2)
        assert moved.mean() < OUTLINES
        # Away from all outlines, nothing moves by more than a code.
        spread = np.abs(np.diff(case.baseline.astype(int), axis=0, append=case.baseline[-1:])).max(axis=2)
        spread += np.abs(np.diff(case.baseline.astype(int), axis=1, append=case.baseline[:, -1:])).max(axis=2)
        calm = np.ones_like(moved)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                calm &= np.roll(spread, (down, right), axis=(0, 1)) <= 2
        assert calm.any()
        assert not (moved & calm).any()

    @pytest.mark.parametrize("name", sorted(name for name, kind in NOISES.items() if kind.write))
    @pytest.mark.parametrize("scene", ["rates", "near"])
    def test_a_file_stored_otherwise_has_the_same_pixels(self, name: str, scene: str, cases: Any, tmp_path: Path) -> None:
        case, write = cases(scene), NOISES[name].write
        assert write is not None
        path = tmp_path / f"stored{suffix(scene)}"
        write(case, path)
        assert path.read_bytes() != case.path.read_bytes()
        assert np.array_equal(picture_file.read_part(path, picture_file.parts(path)[0]), case.baseline)
        assert picture_file.attributes(path)["glshade:renderer"] == case.attributes["glshade:renderer"]

    def test_random_kinds_follow_from_the_seed(self, cases: Any) -> None:
        case = cases("rates")
        kind = REGRESSIONS["noise-burst"]
        first, again, other = (
            kind.make(Case(case.name, case.scene, case.path, case.renderer, seed), 100) for seed in (1, 1, 2)
        )
        assert first is not None
        assert np.array_equal(first, again)
        assert not np.array_equal(first, other)

    def test_a_fault_that_does_not_apply_makes_no_picture(self, cases: Any) -> None:
        for name in ("alpha-lost", "not-a-number", "texture-shifted", "lamp-moved"):
            assert REGRESSIONS[name].make(cases("rates"), REGRESSIONS[name].strengths[0]) is None


class TestCodes:
    """Codes, which are what faults of finished pictures change."""

    @given(arrays(np.float32, (2, 3, 3), elements=st.floats(0, 100, width=32)))
    def test_codes_of_floats_become_the_floats_again(self, pixels: Any) -> None:
        assert linear_of(codes_of(pixels)) == pytest.approx(pixels, rel=2e-6, abs=1e-6)

    @given(arrays(np.uint8, (4, 4, 3)), st.integers(0, 2))
    def test_a_difference_of_two_codes_is_not_counted(self, pixels: Any, amount: int) -> None:
        other = np.clip(pixels.astype(int) + amount, 0, 255).astype(np.uint8)
        assert differing(pixels, other, 2) == 0

    @given(arrays(np.uint8, (4, 4, 3), elements=st.integers(0, 200)), st.integers(3, 50))
    def test_a_larger_difference_counts_each_pixel_once(self, pixels: Any, amount: int) -> None:
        other = pixels.copy()
        other[1:3, 1] += np.uint8(amount)
        assert differing(pixels, other, 2) == 2

    def test_nan_counts_as_visible(self) -> None:
        pixels = np.zeros((4, 4, 3), dtype=np.float32)
        other = pixels.copy()
        other[0, 0, 0] = np.nan
        assert differing(pixels, other, 2) >= 10

    def test_pixels_that_keep_their_codes_keep_their_bits(self, cases: Any) -> None:
        case = cases("near")
        assert np.array_equal(case.of_codes(case.codes), case.baseline)


class TestPlan:
    """The list of pairs."""

    def test_the_whole_plan_has_every_kind_with_every_scene(self) -> None:
        items = planned()
        assert len(items) == len(set(items)) == 10 * (3 * len(REGRESSIONS) + len(NOISES))
        assert items == sorted(items)

    @settings(max_examples=10)
    @given(st.integers(1, 200), st.integers(0, 5))
    def test_a_part_follows_from_the_seed(self, count: int, seed: int) -> None:
        items = planned(count, seed)
        assert items == planned(count, seed)
        assert len(set(items)) == count
        assert set(items) <= set(planned())
        assert set(planned(count // 2, seed)) <= set(items)


class TestMaking:
    """The files of a corpus."""

    ITEMS = (
        Item("rates", "noises", "rounded-down"),
        Item("rates", "noises", "texts-added"),
        Item("rates", "regressions", "alpha-lost", 1),
        Item("rates", "regressions", "light-lost", 1),
        Item("rates", "regressions", "noise-burst", 2),
    )

    def test_pairs_are_written_once_and_a_second_folder_has_the_same_bytes(self, tmp_path: Path) -> None:
        first = list(make(tmp_path / "one", self.ITEMS, size=SMALL))
        made = [pair for pair in first if isinstance(pair, Made)]
        assert [pair.item for pair in made] == [item for item in self.ITEMS if item.kind != "alpha-lost"]
        assert all(pair.test.is_file() and pair.reference.is_file() for pair in made)
        assert not [path for path in (tmp_path / "one").rglob(".*") if path.is_file()]
        list(make(tmp_path / "two", self.ITEMS, size=SMALL))
        # The files of scenes name no folders of the corpus.
        assert files(tmp_path / "one") == files(tmp_path / "two")

    def test_a_run_that_goes_on_draws_only_what_is_missing(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        list(make(tmp_path, self.ITEMS, size=SMALL))
        before, lost = files(tmp_path), self.ITEMS[3].path(tmp_path)
        lost.unlink()
        times = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.png")}
        list(make(tmp_path, self.ITEMS, size=SMALL))
        assert files(tmp_path) == before
        assert all(path.stat().st_mtime_ns == time for path, time in times.items())
        # With everything there, no context is opened.
        monkeypatch.setattr("glshade.gl.renderer.Renderer", None)
        assert len(list(make(tmp_path, self.ITEMS, size=SMALL))) == len(self.ITEMS)

    def test_a_folder_of_another_corpus_is_refused(self, tmp_path: Path) -> None:
        list(make(tmp_path / "corpus", [], seed=1, size=SMALL))
        with pytest.raises(GlshadeError, match="another folder"):
            list(make(tmp_path / "corpus", [], seed=2, size=SMALL))
        (tmp_path / "corpus" / "corpus.json").write_text("{")
        with pytest.raises(GlshadeError, match="another folder"):
            list(make(tmp_path / "corpus", [], seed=1, size=SMALL))

    def test_a_folder_with_other_files_is_refused(self, tmp_path: Path) -> None:
        (tmp_path / "thesis.txt").write_text("")
        with pytest.raises(GlshadeError, match="neither empty nor a corpus"):
            list(make(tmp_path, [], size=SMALL))
        assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]

    def test_a_driver_that_cannot_be_used_is_reported(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("glshade.bench.corpus.making.draw_elsewhere", lambda *given: "no such driver")
        lines: list[str] = []
        item = Item("rates", "noises", "osmesa")
        assert list(make(tmp_path, [item], size=SMALL, report=lines.append)) == [item]
        assert lines == ["rates, osmesa: not drawn: no such driver"]

    def test_a_driver_with_one_sample_leaves_out_scenes_with_several(self, tmp_path: Path) -> None:
        item = Item("rates", "noises", "softpipe")
        assert list(make(tmp_path, [item], size=SMALL)) == [item]

    @pytest.mark.slow
    def test_another_process_draws_the_same_picture(self, tmp_path: Path, cases: Any) -> None:
        case = cases("rates")
        path = tmp_path / "again.png"
        assert draw_elsewhere({"backend": "egl"}, [(case.path.with_name("scene.json"), path)]) == ""
        assert path.read_bytes() == case.path.read_bytes()

    @pytest.mark.slow
    def test_a_process_that_fails_says_why(self, tmp_path: Path) -> None:
        (tmp_path / "scene.json").write_text("{}")
        assert "objects" in draw_elsewhere({"backend": "egl"}, [(tmp_path / "scene.json", tmp_path / "picture.png")])
        assert not (tmp_path / "picture.png").exists()


@pytest.mark.slow
def test_most_pairs_of_the_corpus_are_visible(tmp_path: Path) -> None:
    shown = total = 0
    for pair in make(tmp_path, planned(90, seed=3)):
        if isinstance(pair, Made) and pair.item.group == "regressions":
            reference, test = (picture_file.read_part(p, picture_file.parts(p)[0]) for p in (pair.reference, pair.test))
            total += 1
            shown += differing(reference, test, 2) >= 10
    assert total > 30
    assert shown >= 0.8 * total
    assert json.loads((tmp_path / "corpus.json").read_text())["seed"] == 0
