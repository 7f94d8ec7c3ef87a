"""Comparison: the finite gate, classes of pixels, intervals and metrics, on pictures made by hand."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade.image import file as picture_file
from glshade.page.ramp import heat
from glshade.verification.judgement import Expected, PixelClass, classify, judge
from glshade.verification.report import CLASS_COLOURS, CLASS_MEANING, UNEXPLAINED, Report, class_map, write

SIZE = (4, 3)
BACKGROUND = np.array([0.25, 0.5, 0.75, 1.0])


def expected(
    pixel: list[int], centre: float = 1.0, room: float = 0.01, open_: Any = (), kind: PixelClass = PixelClass.INTERIOR
) -> Expected:
    """Returns a picture whose pixels `pixel` show `centre` to within `room`, and the background elsewhere."""
    number = SIZE[0] * SIZE[1]
    classes = np.full(number, PixelClass.BACKGROUND, dtype=np.uint8)
    classes[pixel] = kind
    opened = np.zeros(number, dtype=bool)
    opened[list(open_)] = True
    middle = np.full((len(pixel), 4), centre)
    return Expected(SIZE, BACKGROUND, classes, opened, np.array(pixel), middle - room, middle + room, middle)


def picture(value: float, pixel: list[int]) -> Any:
    pixels = np.tile(BACKGROUND.astype(np.float32), (SIZE[1] * SIZE[0], 1))
    pixels[pixel] = value
    return pixels.reshape(SIZE[1], SIZE[0], 4)


def test_all_explained() -> None:
    c = judge(picture(1.005, [3, 5]), expected([3, 5]))
    assert c.unexplained == 0
    assert c.counts[PixelClass.INTERIOR] == 2
    assert c.worst == pytest.approx(0.005, abs=1e-6)
    assert c.used.max() == pytest.approx(0.5, abs=1e-3)
    assert c.ambiguous == 0


def test_what_is_not_finite_is_found_before_anything_else() -> None:
    pixels = picture(1.0, [3])
    pixels[0, 0, 1] = np.nan
    pixels[2, 2, 0] = np.inf
    c = judge(pixels, expected([3]))
    assert (c.non_finite, c.unexplained) == (2, 2)
    c = judge(np.full_like(pixels, np.nan), expected([3]))
    assert c.non_finite == pixels.size
    assert c.unexplained == 12
    assert np.isfinite([c.worst, c.rmse, c.p999]).all()


def test_a_masked_pixel_that_is_not_finite_still_counts() -> None:
    pixels, mask = picture(1.0, [3]), np.ones((SIZE[1], SIZE[0]), dtype=bool)
    pixels[0, 0, 0] = np.nan
    assert judge(pixels, expected([3]), mask).non_finite == 1


@pytest.mark.parametrize("value", [0.98, 1.02, float(np.nextafter(np.float32(1.01), np.float32(2)))])
def test_outside_the_interval(value: float) -> None:
    assert judge(picture(value, [3]), expected([3])).unexplained == 1


def test_background_is_exact() -> None:
    pixels = picture(1.0, [3])
    pixels[0, 0, 2] = np.nextafter(np.float32(0.75), np.float32(1))
    assert judge(pixels, expected([3])).unexplained == 1
    missing = judge(picture(1.0, []), expected([3]))
    assert missing.unexplained == 1
    assert missing.empty
    assert not missing.may_be_empty


def test_a_silhouette_is_one_or_the_other_and_never_a_blend() -> None:
    silhouette = expected([3], open_=[3], kind=PixelClass.SILHOUETTE)
    assert judge(picture(1.0, [3]), silhouette).unexplained == 0
    assert judge(picture(0.0, []), silhouette).unexplained == 0
    blend = picture(1.0, [3])
    blend[0, 3] = 0.5 * (blend[0, 3] + BACKGROUND)
    assert judge(blend, silhouette).unexplained == 1
    assert judge(blend, silhouette).ambiguous == pytest.approx(1 / 12)


def test_one_of_several_candidates_is_enough() -> None:
    two = expected([3, 3])
    two.low[1] -= 0.5
    two.high[1] -= 0.5
    two.centre[1] -= 0.5
    for value, which in ((1.0, 0), (0.5, 1)):
        c = judge(picture(value, [3]), two)
        assert c.unexplained == 0
        assert c.candidate[3] == which
    assert judge(picture(0.75, [3]), two).unexplained == 1


def test_masked_pixels_are_left_out_and_counted() -> None:
    mask = np.zeros((SIZE[1], SIZE[0]), dtype=bool)
    mask[0, 3] = True
    c = judge(picture(7.0, [3]), expected([3]), mask)
    assert c.unexplained == 0
    assert c.counts[PixelClass.MASKED] == 1
    assert c.doubtful == 1


def test_shapes_must_agree() -> None:
    with pytest.raises(glshade.GlshadeError, match=r"not \(3, 4, 3 or 4\)"):
        judge(np.zeros((4, 3, 3)), expected([3]))


def classified(*candidates: tuple[float, float, bool, bool]) -> tuple[Any, PixelClass, bool]:
    """Returns (kept, class, open) of one pixel's candidates (depth, slack, partial, sealed)."""
    depth, slack, partial, sealed = (np.array(column) for column in zip(*candidates, strict=True))
    kept, classes, open_, _ = classify(
        1, np.zeros(len(depth), dtype=int), depth + slack, depth - slack, partial, np.where(sealed, 0, -1)
    )
    return kept.tolist(), PixelClass(classes[0]), bool(open_[0])


FULL, PARTIAL, SEALED = (False, False), (True, False), (True, True)


def test_classes() -> None:
    assert classified((0.5, 0.01, *FULL)) == ([True], PixelClass.INTERIOR, False)
    assert classified((0.5, 0.01, *FULL), (0.3, 0.01, *FULL)) == ([True, False], PixelClass.INTERIOR, False)
    assert classified((0.5, 0.01, *FULL), (0.49, 0.01, *FULL)) == ([True, True], PixelClass.TIE, False)
    assert classified((0.5, 0.01, *PARTIAL)) == ([True], PixelClass.SILHOUETTE, True)
    assert classified((0.5, 0.01, *FULL), (0.7, 0.01, *PARTIAL)) == ([True, True], PixelClass.SILHOUETTE, False)
    assert classified((0.5, 0.01, *FULL), (0.3, 0.01, *PARTIAL)) == ([True, False], PixelClass.INTERIOR, False)
    assert classified((0.5, 0.01, *SEALED), (0.5, 0.01, *SEALED)) == ([True, True], PixelClass.SEAM, False)
    assert classified((0.5, 0.01, *SEALED), (0.5, 0.01, *SEALED), (0.2, 0.01, *FULL))[0] == [True, True, False]


def test_two_pictures() -> None:
    a = np.zeros((2, 2, 3), dtype=np.float32)
    b = a.copy()
    b[1, 1, 2] = 0.5
    assert glshade.compare(a, a).same
    difference = glshade.compare(glshade.Image(a), b)
    assert (difference.worst, difference.differing, difference.same) == (0.5, 1, False)
    assert glshade.compare(a, b, tolerance=0.5).same
    assert glshade.compare(a, b, mask=np.array([[0, 0], [0, 1]], dtype=bool)).same
    b[0, 0, 0] = np.nan
    assert not glshade.compare(b, b).same
    with pytest.raises(glshade.GlshadeError, match="shapes"):
        glshade.compare(a, a[:1])


def test_heat_map_has_its_ends() -> None:
    colours, least, greatest = heat(np.array([[0.0, 1.0, np.inf]]))
    assert (least, greatest) == (1e-8, 1.0)
    assert colours[0, 0].sum() < 100
    assert (colours[0, 1] == colours[0, 2]).all()
    assert colours[0, 1].sum() > 500


def test_the_report_holds_everything(tmp_path: Path) -> None:
    pixels = picture(1.5, [3])
    pixels[2, 2] = np.nan
    c = judge(pixels, expected([3]))
    classes = expected([3]).classes.reshape(SIZE[1], SIZE[0])
    report = Report(
        "<title>", "failed", ["a reason"], pixels, picture(1.0, [3]), c, classes, {"fact": "a & b"}, ["x"], [["<3>"]]
    )
    page = write(tmp_path / "new" / "folder", report)
    text = page.read_text(encoding="utf-8")
    assert {path.name for path in page.parent.iterdir()} == {
        *("index.html", "result.png", "reference.png", "error.png", "classes.png"),
        *("result.exr", "reference.exr", "error.exr"),
    }
    assert text.count("data:image/png;base64,") == 4
    assert not re.search(r"https?:", text), "the page needs nothing from elsewhere"
    assert "&lt;title&gt;" in text
    assert "a &amp; b" in text
    assert "&lt;3&gt;" in text
    assert (class_map(classes, c.excess)[0, 3] == (255, 0, 60)).all()
    assert all(CLASS_MEANING[kind] in html.unescape(text) for kind in PixelClass)


def test_the_report_of_8_bit_pictures_shows_their_codes(tmp_path: Path) -> None:
    pixels = np.full((SIZE[1], SIZE[0], 3), (10, 200, 30), dtype=np.uint8)
    c = judge(picture(1.0, [3]), expected([3]))
    page = write(tmp_path, Report("codes", "verified", [], pixels, pixels, c, c.error.astype(np.uint8), {}, [], []))
    assert {path.name for path in page.parent.glob("*.exr")} == {"error.exr"}
    path = tmp_path / "result.png"
    assert (picture_file.read_part(path, picture_file.parts(path)[0]) == pixels).all()


def test_every_class_has_its_own_colour() -> None:
    assert set(CLASS_COLOURS) == set(CLASS_MEANING) == set(PixelClass)
    assert len({*CLASS_COLOURS.values(), UNEXPLAINED}) == len(PixelClass) + 1
