"""The scene judge: the five verdicts, drivers, scenes that do not fit, and pictures that the reference does not judge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import faulty

from glshade.errors import ContextError
from glshade.golden import scene_judge
from glshade.golden.judge import compare_files, compare_variants
from glshade.golden.names import sidecar_path
from glshade.golden.result import Outcome, Result, SceneVerdict
from glshade.golden.rules.codes import Codes
from glshade.golden.scene_judge import SceneJudge
from glshade.golden.sidecar import Driver, Origin
from glshade.reference.freedom import LLVMPIPE, UNMEASURED
from glshade.scene.digest import scene_digest
from glshade.verification.candidates import find_candidates
from glshade.verification.judgement import PixelClass

SCENE = faulty.scene()
TRUE = faulty.drawn(SCENE)


@pytest.fixture(scope="module")
def judge() -> SceneJudge:
    """One judge for all tests, which keeps the scene's candidates."""
    return SceneJudge(SCENE)


@pytest.fixture
def compare(tmp_path: Path, judge: SceneJudge) -> Any:
    """A function that writes two pictures and compares them by the scene."""

    def compare(reference: Any, test: Any, **further: Any) -> Result:
        suffix = ".png" if test.dtype == np.uint8 else ".exr"
        paths = [faulty.save(tmp_path / f"{name}{suffix}", pixels) for name, pixels in (("ref", reference), ("test", test))]
        return compare_files(paths[0], paths[1], Codes(), scenes=further.pop("scenes", judge), **further)

    return compare


def without_outline(picture: Any) -> Any:
    """Returns a picture in which the ball's outline is decided the other way: where a driver may show the wall, it does."""
    candidates = find_candidates(SCENE, driver=UNMEASURED).expected
    result = picture.copy()
    height, width = picture.shape[:2]
    farther = np.full((height * width, 3), np.nan)
    for pixel, centre in zip(candidates.pixel, candidates.centre, strict=True):
        # The wall's candidate is the greener one.
        if np.isnan(farther[pixel, 0]) or centre[1] - centre[0] > farther[pixel, 1] - farther[pixel, 0]:
            farther[pixel] = centre[:3]
    outline = (candidates.classes == PixelClass.SILHOUETTE).reshape(height, width)
    shown = farther.reshape(height, width, 3)[outline]
    result[outline] = faulty.codes(shown[None])[0] if picture.dtype == np.uint8 else shown
    return result


def dimmed() -> Any:
    """Returns the picture with another strength of the light key."""
    return faulty.drawn(faulty.scene(lambda d: d["lights"][0].update(intensity=15.0)))


@pytest.mark.parametrize("stored", [faulty.codes, np.float32], ids=["codes", "floats"])
def test_verdicts(compare: Any, stored: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    true, wrong, other = stored(TRUE), stored(dimmed()), without_outline(stored(TRUE))
    assert compare(true, true).verdict is None, "the same bytes are compared by nobody"

    # One code of noise is more than the reference allows, but 8-bit pictures may have it.
    noise = np.random.default_rng(3).integers(-1, 2, true.shape)
    near = (true + noise).astype(np.uint8) if true.dtype == np.uint8 else (true * (1 + 3e-7 * noise)).astype(np.float32)
    same = compare(true, near)
    assert (same.verdict, same.outcome, same.reason, same.causes) == (SceneVerdict.SAME, Outcome.SAME, "", ())

    free = compare(true, other)
    assert (free.verdict, free.outcome, free.causes) == (SceneVerdict.FREEDOM, Outcome.SAME, ())
    assert np.count_nonzero((true != other).any(axis=2)) > 4, "the rule alone would have failed"

    stale = compare(wrong, true)
    assert (stale.verdict, stale.outcome, stale.causes) == (SceneVerdict.STALE, Outcome.WARN, ())

    regression = compare(true, wrong)
    assert (regression.verdict, regression.outcome) == (SceneVerdict.REGRESSION, Outcome.FAIL)
    assert [cause.text for cause in regression.causes] == ["light key x 0.60"]
    both_wrong = compare(wrong, stored(dimmed() * 0.9))
    assert both_wrong.verdict is SceneVerdict.REGRESSION

    monkeypatch.setattr(scene_judge, "MOST_FREE", 0.0)
    both = compare(true, other)
    assert (both.verdict, both.outcome) == (SceneVerdict.BOTH_RIGHT, Outcome.WARN)
    assert "as a variant?" in both.reason


def test_nan_fails_before_anything_else(compare: Any) -> None:
    wrong = TRUE.copy()
    wrong[3, 7, 1] = np.nan
    result = compare(TRUE, wrong)
    assert (result.verdict, result.outcome) == (SceneVerdict.REGRESSION, Outcome.FAIL)
    assert [cause.text for cause in result.causes] == ["1 value is infinite or NaN, the first at x = 7, y = 3"]
    assert compare(wrong, TRUE).outcome is Outcome.FAIL


def test_a_few_pixels_are_placed(compare: Any) -> None:
    wrong = TRUE.copy()
    wrong[36, 48] *= 2
    (cause,) = compare(TRUE, wrong).causes
    assert (cause.kind, cause.object, cause.stage, cause.pixels) == ("unknown", "ball", "shading", 1)
    assert cause.triangle >= 0
    assert cause.text == "shading of ball, 1 triangle: 1 pixel round x = 48, y = 36"


def test_masked_pixels_do_not_count(compare: Any) -> None:
    wrong = TRUE.copy()
    wrong[:10] *= 2
    mask = np.zeros(TRUE.shape[:2], dtype=np.bool_)
    mask[:10] = True
    assert compare(TRUE, wrong).verdict is SceneVerdict.REGRESSION
    assert compare(TRUE, wrong, mask=mask).outcome is Outcome.SAME
    wrong[40] *= 2
    assert compare(TRUE, wrong, mask=mask).verdict is SceneVerdict.REGRESSION


def test_a_baseline_of_the_reference_is_right(tmp_path: Path, compare: Any) -> None:
    other = without_outline(TRUE)
    paths = [faulty.save(tmp_path / f"{name}.exr", pixels) for name, pixels in (("ref", TRUE * 0.5), ("test", other))]
    judge = SceneJudge(SCENE)
    for digest, verdict in ((scene_digest(SCENE), SceneVerdict.BOTH_RIGHT), ("0" * 64, SceneVerdict.STALE)):
        origin = Origin(made_by="reference", scene_digest=digest)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("glshade.golden.sidecar.origin_of", lambda path, origin=origin: origin)
            result = compare_files(*paths, Codes(), scenes=judge)
        assert result.verdict is verdict, digest


def test_the_driver_decides_how_far_pictures_may_differ(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wide = without_outline(TRUE)
    faulty.save(tmp_path / "ref.exr", TRUE)
    faulty.save(tmp_path / "test.exr", wide)
    opened = []

    def refuse(*_: Any) -> None:
        opened.append(True)
        raise ContextError("no driver")

    monkeypatch.setattr("glshade.gl.context.open_context", refuse)

    def result(origin: Origin, **settings: Any) -> Result:
        paths = [_variant(tmp_path / "ref.exr")], tmp_path / "test.exr"
        return compare_variants(*paths, Codes(), scenes=SceneJudge(SCENE, **settings), origin=origin)

    exact = Origin(driver=Driver(renderer="llvmpipe"), freedom=LLVMPIPE.as_dict())
    assert result(exact).verdict is SceneVerdict.REGRESSION, "this driver cannot have drawn the outline"
    assert result(Origin()).verdict is SceneVerdict.FREEDOM
    assert not opened, "no driver is asked about itself unless a picture names one"
    named = Origin(driver=Driver(renderer="another"))
    assert result(named).verdict is SceneVerdict.FREEDOM
    assert opened, "the driver at hand might have been the one"
    with monkeypatch.context() as patch:
        patch.setattr("glshade.golden.sidecar.origin_of", lambda path: named)
        same_driver = result(named)
        assert same_driver.verdict is SceneVerdict.BOTH_RIGHT, "a driver draws the same scene alike each time"
        assert same_driver.reason.endswith("although one driver drew both: has the scene changed?")
    chosen = result(named, backend="egl")
    assert (chosen.outcome, chosen.reason) == (Outcome.FILE, "no driver")


def _variant(path: Path) -> Any:
    from glshade.golden.baselines import Variant

    return Variant(path, "", None)


def test_a_scene_that_cannot_be_used(tmp_path: Path, compare: Any) -> None:
    small = TRUE[:40]
    sizes = compare(small, small * 0.5)
    assert sizes.outcome is Outcome.FILE
    assert sizes.reason == (
        "the scene: its picture has 96x72 pixels, and the compared ones have 96x40; give the scene with the film's size that "
        "they were drawn with"
    )
    for text in (None, "objects = 3"):
        path = tmp_path / "broken.toml"
        if text is not None:
            path.write_text(text)
        broken = compare(TRUE, TRUE * 0.5, scenes=SceneJudge(path))
        assert broken.outcome is Outcome.FILE
        assert "broken.toml" in broken.reason
        assert "\n" not in broken.reason
    assert compare(TRUE, TRUE, scenes=SceneJudge(path)).outcome is Outcome.SAME, "equal pixels need no scene"


def test_pictures_that_the_reference_does_not_judge(tmp_path: Path, compare: Any) -> None:
    viewed = faulty.scene(
        lambda d: d["film"].update(view="ACES 1.0 - SDR Video", display="sRGB - Display", ocio="ocio://default")
    )
    true = faulty.codes(TRUE)
    result = compare(true, true // 2, scenes=SceneJudge(viewed))
    assert (result.outcome, result.verdict) == (Outcome.FAIL, None)
    assert "not judged by the reference" in " ".join(result.notes)
    grey = true[..., :1]
    result = compare(grey, grey // 2)
    assert (result.outcome, result.verdict) == (Outcome.FAIL, None)
    assert result.notes == ("not judged by the reference: only pictures with the channels R, G, B or R, G, B, A are judged",)


def test_the_nearest_variant_that_is_the_same_counts(tmp_path: Path) -> None:
    true = faulty.codes(TRUE)
    variants = [
        _variant(faulty.save(tmp_path / f"ball@{name}.png", pixels)) for name, pixels in (("a", true // 2), ("b", true))
    ]
    test = faulty.save(tmp_path / "test.png", true)
    result = compare_variants(variants, test, Codes(), "ball.png")
    assert result.outcome is Outcome.SAME
    assert result.baseline == str(tmp_path / "ball@b.png")
    assert result.distances["ball@b.png"] == 0.0
    assert result.distances["ball@a.png"] > 0.1
    assert not sidecar_path(test).exists()
