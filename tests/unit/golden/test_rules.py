"""The rules `exact`, `codes` and `idiff`, on two layers; and the sizes of their differences."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.golden.pair import Pair
from glshade.golden.result import Metrics, Outcome
from glshade.golden.rules import RULES
from glshade.golden.rules.codes import Codes
from glshade.image import file as picture_file
from glshade.image.contents import PictureContents

GREY = np.full((40, 40, 3), 100, dtype=np.uint8)
RGB = ("R", "G", "B")


def pair(reference: Any, test: Any, channels: tuple[str, ...] = RGB) -> Pair:
    return Pair("", channels, reference, test)


def changed(picture: Any, *pixels: tuple[int, int, Any]) -> Any:
    """Returns a copy of the picture with other values: (row, column, value) each."""
    result = picture.copy()
    for row, column, value in pixels:
        result[row, column] = value
    return result


def outcome(rule: str, reference: Any, test: Any, channels: tuple[str, ...] = RGB, **settings: Any) -> Outcome:
    return RULES[rule](**settings).judge(pair(reference, test, channels)).outcome


def test_the_rules_are_the_files_of_the_folder() -> None:
    assert list(RULES) == ["codes", "exact", "idiff"]


def test_every_rule_accepts_equal_pictures() -> None:
    for rule in RULES:
        assert outcome(rule, GREY, GREY.copy()) is Outcome.SAME


def test_exact_refuses_one_code() -> None:
    assert outcome("exact", GREY, changed(GREY, (3, 4, [100, 101, 100]))) is Outcome.FAIL


class TestCodes:
    """The rule `codes`."""

    def test_every_pixel_may_differ_by_one_code(self) -> None:
        assert outcome("codes", GREY, GREY + 1) is Outcome.SAME
        assert outcome("codes", GREY, GREY - 1) is Outcome.SAME

    def test_no_code_wraps_around(self) -> None:
        assert outcome("codes", np.zeros_like(GREY), np.full_like(GREY, 255)) is Outcome.FAIL

    def test_one_pixel_of_a_new_colour_fails(self) -> None:
        assert outcome("codes", GREY, changed(GREY, (3, 4, 102))) is Outcome.FAIL

    def test_alpha_counts(self) -> None:
        rgba = np.full((40, 40, 4), 100, dtype=np.uint8)
        assert outcome("codes", rgba, changed(rgba, (3, 4, [100, 100, 100, 90])), ("R", "G", "B", "A")) is Outcome.FAIL

    @pytest.mark.parametrize(("moved", "expected"), [(4, Outcome.SAME), (5, Outcome.FAIL)])
    def test_four_pixels_of_an_edge_may_take_the_value_of_a_neighbour(self, moved: int, expected: Outcome) -> None:
        reference = GREY.copy()
        reference[:, 20:] = 200
        test = changed(reference, *((row, 20, 101) for row in range(0, 4 * moved, 4)))
        assert outcome("codes", reference, test) is expected

    def test_of_a_large_picture_more_pixels_may(self) -> None:
        reference = np.full((200, 200, 3), 100, dtype=np.uint8)
        reference[:, 100:] = 200
        rows = np.arange(0, 200, 10)
        test = reference.copy()
        test[rows, 100] = 100
        assert outcome("codes", reference, test) is Outcome.SAME
        test[5, 100] = 100
        assert outcome("codes", reference, test) is Outcome.FAIL

    def test_the_value_must_be_around_the_pixel_in_both_pictures(self) -> None:
        reference = changed(GREY, (10, 10, 200))
        # The dot is gone: the reference has the new value all around, but the test has the dot's value nowhere.
        assert outcome("codes", reference, GREY) is Outcome.FAIL
        assert outcome("codes", GREY, reference) is Outcome.FAIL
        assert outcome("codes", reference, changed(GREY, (10, 11, 200))) is Outcome.SAME
        assert outcome("codes", reference, changed(GREY, (10, 12, 200))) is Outcome.FAIL

    def test_a_pixel_of_the_border_has_neighbours(self) -> None:
        reference, test = changed(GREY, (0, 0, 200)), changed(GREY, (0, 1, 200))
        assert outcome("codes", reference, test) is Outcome.SAME

    @pytest.mark.parametrize(
        ("a", "b", "expected"),
        [
            (0.5, 0.5001, Outcome.SAME),
            (0.5, 0.52, Outcome.FAIL),
            (0.998, 1.002, Outcome.SAME),
            (4.0, 4.015, Outcome.SAME),
            (4.0, 4.02, Outcome.FAIL),
            (-0.2, -0.8, Outcome.FAIL),
            (-3.0, -2.0, Outcome.FAIL),
            (-0.5, 0.5, Outcome.FAIL),
            (1.0, 2.0, Outcome.FAIL),
        ],
    )
    def test_floats(self, a: float, b: float, expected: Outcome) -> None:
        reference, test = (np.full((40, 40, 3), value, dtype=np.float32) for value in (a, b))
        assert outcome("codes", reference, test) is expected
        assert outcome("codes", test, reference) is expected

    def test_alpha_is_not_srgb_encoded(self) -> None:
        reference, test = (np.full((40, 40, 1), value, dtype=np.float32) for value in (0.01, 0.013))
        assert outcome("codes", reference, test, ("A",)) is Outcome.SAME
        assert outcome("codes", reference, test, ("Y",)) is Outcome.FAIL

    @pytest.mark.parametrize(
        ("name", "channels", "ids"),
        [
            ("object_id", ("I",), True),
            ("shapes", ("I",), True),
            ("material_id", ("Y",), True),
            ("beauty:object_id", ("X",), True),
            ("CryptoObject00", ("R", "G", "B", "A"), True),
            ("ViewLayer.uCryptoAsset01", ("r", "g", "b", "a"), True),
            ("", ("object_id",), True),
            ("", ("I",), False),
            ("fluid", ("R", "G", "B"), False),
            ("", ("R", "G", "B", "object_id"), False),
        ],
    )
    def test_ids_must_be_equal(self, name: str, channels: tuple[str, ...], ids: bool) -> None:
        """Cryptomatte's ids are floats of any size. A picture's colours that differ by as little are the same."""
        reference = np.full((40, 40, len(channels)), 0.5, dtype=np.float32)
        reference[::2] = 1e38
        test = reference.copy()
        test[7, 9] *= np.float32(1.0001)
        finding = Codes().judge(Pair(name, channels, reference, test))
        assert finding.outcome is (Outcome.FAIL if ids else Outcome.SAME)
        assert finding.reason == ("1 of 1600 pixels differ; these are ids, which must be equal" if ids else "")
        assert Codes().judge(Pair(name, channels, reference, reference.copy())).outcome is Outcome.SAME

    def test_codes_and_floats(self) -> None:
        linear = np.full((40, 40, 3), ((100 / 255 + 0.055) / 1.055) ** 2.4, dtype=np.float32)
        assert outcome("codes", GREY, linear) is Outcome.SAME
        assert outcome("codes", GREY, linear * 1.1) is Outcome.FAIL
        assert outcome("codes", np.full_like(GREY, 255), np.full((40, 40, 3), 2.0, dtype=np.float32)) is Outcome.FAIL


class TestIdiff:
    """The rule `idiff`. The picture has 100 pixels, and n of them differ by 0.5."""

    @pytest.mark.parametrize(
        ("settings", "n", "expected"),
        [
            ({}, 1, Outcome.FAIL),
            ({"fail": 0.6}, 100, Outcome.SAME),
            ({"fail": 0.6, "warn": 0.6}, 100, Outcome.SAME),
            ({"fail": 0.4, "failpercent": 10}, 10, Outcome.WARN),
            ({"fail": 0.4, "failpercent": 10}, 11, Outcome.FAIL),
            ({"fail": 0.4, "failpercent": 10, "warn": 0.4, "warnpercent": 10}, 10, Outcome.SAME),
            ({"fail": 0.4, "failpercent": 57}, 57, Outcome.WARN),
            ({"failpercent": 100, "warnpercent": 100, "hardfail": 0.4}, 1, Outcome.FAIL),
            ({"failpercent": 100, "warnpercent": 100, "hardfail": 0.6, "hardwarn": 0.4}, 1, Outcome.WARN),
            ({"failpercent": 100, "warnpercent": 100, "hardfail": 0.6, "hardwarn": 0.6}, 1, Outcome.SAME),
            ({"allowfailures": 3}, 3, Outcome.SAME),
            ({"allowfailures": 3}, 4, Outcome.FAIL),
            ({"allowfailures": 3, "hardfail": 0.1, "hardwarn": 0.1}, 3, Outcome.SAME),
            ({"allowfailures": 3, "hardfail": 0.1, "failpercent": 100}, 4, Outcome.FAIL),
        ],
    )
    def test_thresholds(self, settings: dict[str, Any], n: int, expected: Outcome) -> None:
        reference = np.zeros((10, 10, 3), dtype=np.float32)
        test = reference.copy()
        test.reshape(100, 3)[:n, 1] = 0.5
        assert outcome("idiff", reference, test, **settings) is expected

    @pytest.mark.slow
    @settings(max_examples=60)
    @given(
        errors=st.lists(st.sampled_from([0.1, 0.2, 0.3, 0.5]), min_size=1, max_size=40),
        limits=st.dictionaries(
            st.sampled_from(["fail", "warn", "hardfail", "hardwarn"]), st.sampled_from([0.05, 0.15, 0.25, 0.4, 0.6])
        ),
        shares=st.dictionaries(st.sampled_from(["failpercent", "warnpercent"]), st.sampled_from([0.5, 10, 25.5])),
        allowed=st.integers(0, 12),
    )
    def test_the_real_idiff_agrees(
        self, errors: list[float], limits: dict[str, float], shares: dict[str, float], allowed: int, tmp_path: Path
    ) -> None:
        """OpenImageIO installs its idiff beside Python."""
        test = np.zeros((10, 10, 3), dtype=np.float32)
        test.reshape(100, 3)[: len(errors), 1] = errors
        chosen = {**limits, **shares, "allowfailures": allowed}
        for name, pixels in (("a.exr", np.zeros_like(test)), ("b.exr", test)):
            picture_file.write(tmp_path / name, PictureContents(pixels, "linear", premultiplied=True))
        options = [text for key, value in chosen.items() for text in (f"-{key}", str(value))]
        idiff = Path(sys.executable).with_name("idiff")
        done = subprocess.run([idiff, *options, "a.exr", "b.exr"], cwd=tmp_path, capture_output=True, text=True)
        assert done.stdout.splitlines()[-1] in ("PASS", "WARNING", "FAILURE")
        assert outcome("idiff", np.zeros_like(test), test, **chosen) == done.returncode, done.stdout

    def test_codes_count_as_shares_of_255(self) -> None:
        assert outcome("idiff", GREY, GREY + 1, fail=1 / 254, warn=1 / 254) is Outcome.SAME
        assert outcome("idiff", GREY, GREY + 1, fail=1 / 256) is Outcome.FAIL


def test_an_id_has_no_size() -> None:
    """Cryptomatte's ids are floats of any size, and would be the largest differences of every file."""
    reference = np.full((10, 10, 4), 1e30, dtype=np.float32)
    test = changed(reference, (1, 2, [2e30, 1e30, 1e30, 1e30]), (3, 4, [1e30, 3, 1e-30, 1e30]))
    assert Pair("CryptoObject00", ("R", "G", "B", "A"), reference, test).metrics() == Metrics(1.0, 2**0.5 / 10, 1.0, 3)


@pytest.mark.parametrize("count", [0, 1, 3, 40, 1600])
def test_metrics(count: int) -> None:
    random = np.random.default_rng(count)
    test = GREY.copy()
    test.reshape(-1, 3)[:count] += random.integers(1, 100, (count, 3), dtype=np.uint8)
    errors = np.abs(test.astype(float) - GREY).max(axis=2) / 255
    measured = pair(GREY, test).metrics()
    expected = Metrics(errors.max(), np.sqrt(np.mean(errors**2)), np.quantile(errors, 0.999), 3 * count)
    assert measured.codes == expected.codes
    np.testing.assert_allclose(
        [measured.worst, measured.rmse, measured.p999], [expected.worst, expected.rmse, expected.p999], rtol=1e-12
    )
